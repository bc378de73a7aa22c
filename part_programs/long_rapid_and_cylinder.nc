(From far out to the part by rapid moves, then a cylinder: for drives that run out of voltage on the way)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G94 G71
N20 M03 S1000
N30 G00 X60.0 Z10.0
N40 X16.0
N50 G01 Z45.0 F120
N60 G00 X60.0
N70 Z0.0
N80 X0.0 M05
N90 M30
