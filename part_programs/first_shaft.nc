(Your first part: a shaft with two steps. Complete it.)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G95 G71
N20 G97 S1200 M03
N30 G00 X17.0 Z12.0
N40 G01 Z45.0 F0.2
N50 X18.5
N60 G00 X20.0
N70 Z0.0
N80 X0.0 M05
N90 M30
