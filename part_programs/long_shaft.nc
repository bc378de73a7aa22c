(A long straight pass of 1 mm depth, as one of many parts that wear out an edge)
(Stock: radius 18 mm, face at Z15, length 60 mm. X is a radius; the tool cuts toward +Z)
N10 G90 G95 G71
N20 G97 S1000 M03
N30 G00 X17.0 Z5.0
N40 G01 Z75.0 F0.2
N50 X19.0
N60 G00 Z0.0
N70 X0.0 M05
N80 M30
