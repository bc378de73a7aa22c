(One axis one way only, at four speeds: a run that shows no reversal)
(X is a radius; no stock is meant)
N10 G90 G94 G71 G18
N20 G01 X10.0 F600
N30 X30.0 F1200
N40 X60.0 F1800
N50 X62.0 F300
N60 M30
