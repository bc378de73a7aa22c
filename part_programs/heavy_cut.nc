(A straight pass of 3 mm depth at 0.25 mm: a load the spindle feels)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G95 G71
N20 G97 S1200 M03
N30 G00 X15.0 Z5.0
N40 G01 Z35.0 F0.25
N50 X19.0
N60 G00 Z0.0
N70 X0.0 M05
N80 M30
