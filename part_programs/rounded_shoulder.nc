(A shaft with a fillet of 3 mm and a rounded corner of 2 mm, by radius and by centre)
(Stock: radius 18 mm, face at Z15. X is a radius; the tool cuts toward +Z)
N10 G90 G95 G71 G18
N20 G97 S1200 M03
N30 G00 X12.0 Z12.0
N40 G01 Z27.0 F0.12
(Fillet: counterclockwise seen with +Z to the right and +X up)
N50 G03 X15.0 Z30.0 R3.0
N60 G01 X15.5
(Rounded corner: the centre lies 2 mm along +Z)
N70 G02 X17.5 Z32.0 I0.0 K2.0
N80 G01 Z45.0
N90 X19.0
N100 G00 Z0.0
N110 X0.0 M05
N120 M30
