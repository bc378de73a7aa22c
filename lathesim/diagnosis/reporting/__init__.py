"""What a person reads of a diagnosis: evidence, sentences, figures and the page."""
