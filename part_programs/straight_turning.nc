(Straight turning in three passes of 1 mm, feed per revolution)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G95 G71 G18
N20 G97 S1200 M03
N30 G00 X17.0 Z12.0
N40 G01 Z45.0 F0.2
N50 X19.0
N60 G00 Z12.0
N70 X16.0
N80 G01 Z45.0
N90 X19.0
N100 G00 Z12.0
N110 X15.0
(The last pass with a finer feed)
N120 G01 Z45.0 F0.1
N130 X19.0
N140 G00 Z0.0
N150 X0.0 M05
N160 M30
