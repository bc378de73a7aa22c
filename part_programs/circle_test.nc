(Circle test in air: once round counterclockwise, once clockwise, radius 10 mm, 600 mm/min)
(Made for what circles tell about two axes: lag, unequal gains, backlash at the four reversals)
(Source of the kind of test: ISO 230-4, circular tests. X is a radius; no stock is meant)
N10 G90 G94 G71 G18
N20 M03 S500
N30 G00 X20.0 Z20.0
N40 G01 X30.0 F600
(Centre at X20 Z20: I and K point from the start to it)
N50 G03 X30.0 Z20.0 I-10.0 K0.0
N60 G02 X30.0 Z20.0 I-10.0 K0.0
N70 G01 X20.0
N80 G00 X0.0 Z0.0
N90 M05
N100 M30
