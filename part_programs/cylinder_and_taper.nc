(A cylinder and a slender taper: slow, even motion of both axes, for what converters and encoders do)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G94 G71
N20 M03 S1000
N30 G00 X16.0 Z8.0
N40 G01 Z25.0 F240
N50 X16.5 Z35.0
(Out of the part by a rapid move, so that no corner counts)
N60 G00 X20.0
N70 Z0.0
N80 X0.0 M05
N90 M30
