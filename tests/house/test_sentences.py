"""Manual, README, lessons and helps are easy to read: sentences are short, and words mean the same to everybody."""

from tests.house.sentences import LONG, LONGEST, PRIVATE, counted, plain, private_words, sentences, words

SHARE_OF_LONG = 0.05


def test_no_sentence_is_too_long_and_few_are_long() -> None:
    pages = counted()
    assert [f"{page}: {one}" for page, found in pages.items() for count, one in found if count > LONGEST] == []
    every = [count for found in pages.values() for count, _ in found]
    assert len(every) > 2000
    assert sum(count > LONG for count in every) <= SHARE_OF_LONG * len(every)


def test_no_text_holds_a_private_word() -> None:
    assert private_words() == []


def test_sentences_are_taken_apart_as_they_are_read() -> None:
    table = "| cell | other |\n|---|---|\n| third | x |\n"
    page = f"# Title\n\nOne word, `a b c`. Two words!\n\n- a point\n- another\n\n```sh\nno text\n```\n{table}"
    found = [one for block in plain(page) for one in sentences(block)]
    assert found == ["One word, CODE.", "Two words!", "a point", "another", "cell", "other", "third", "x"]
    assert [words(one) for one in found[:2]] == [3, 2]
    assert PRIVATE.search("1 plug-in in order") and PRIVATE.search("839 floors off") and not PRIVATE.search("they cannot be told apart")
