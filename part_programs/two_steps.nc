(A shaft with two steps: four sharp corners, 240 mm/min)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G94 G71
N20 M03 S1000
N30 G00 X16.0 Z8.0
N40 G01 Z20.0 F240
N50 X17.0
N60 Z25.0
N70 X18.5
N80 G00 X20.0
N90 Z0.0
N100 X0.0 M05
N110 M30
