(A shaft with steps and a chamfer, feed per revolution: corners of all kinds)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G95 G71
N20 G97 S1200 M03
N30 G00 X14.0 Z12.0
N40 G01 Z20.0 F0.15
N50 X16.0
N60 Z25.0
N70 X17.0 Z26.0
N80 Z30.0
N90 X18.5
N100 G00 X20.0 M05
N110 M30
