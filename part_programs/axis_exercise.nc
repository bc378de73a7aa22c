(Exercise of one axis in air: out and back at many speeds, creeping to fast, over different places of the way)
(Made for finding out what an axis does: every speed both ways, reversals, and rest of X while Z moves. X is a radius; no stock)
N10 G90 G94 G71 G18
N20 G01 Z5.0 F1000
N30 G01 X2.0 F120
N40 X0.0
N50 X6.0 F600
N60 X1.0
N70 X21.0 F1500
N80 X6.0
N90 X61.0 F3000
N100 X31.0
N110 G01 Z0.0 F1500
N120 X121.0 F6000
N130 X21.0
N140 X91.0 F4500
N150 X51.0 F2400
N160 X111.0 F5400
N170 X81.0 F1800
N180 X84.0 F240
N190 X81.0
N200 X141.0 F4200
N210 X0.0 F5700
N220 G01 Z5.0 F1000
N230 M30
