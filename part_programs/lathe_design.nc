(The part of Example 1 with one feed per revolution for all cuts, to be made faster by the overrides)
(Source of the path: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20, 2004, Examples 1 and 3)
(Stock: radius 18 mm, length 60 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G95 G71
N20 G00 X15.0 Z10.0
N30 M03 G01 Z30.0 F0.15 S1000
N40 X17.0 Z40.0
N50 Z50.0
N60 X20.0
N70 M00 G00 Z0.0
N80 X0.0
