(Corner test in air: a square of 20 mm with sharp corners, then the same on its tip, 300 mm/min)
(Made for what corners tell: rounding by lag, overshoot, and what acceleration limits change)
(X is a radius; no stock is meant)
N10 G90 G94 G71
N20 G97 S500 M03
N30 G00 X10.0 Z10.0
N40 G01 X30.0 F300
N50 Z30.0
N60 X10.0
N70 Z10.0
(On its tip, incremental)
N80 G91
N90 X10.0 Z10.0
N100 X10.0 Z-10.0
N110 X-10.0 Z-10.0
N120 X-10.0 Z10.0
N130 G90
N140 G00 X0.0 Z0.0
N150 M05
N160 M30
