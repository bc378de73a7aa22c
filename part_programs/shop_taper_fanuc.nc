%
O1003 (dialect: fanuc)
(Taper: single passes with G90 and a finishing pass)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G99
T0101
G50 S2500
G96 S180 M03
G00 X44. Z2.
G90 X40. Z-30. F0.25
X36. Z-24.
X32. Z-16.
G00 X28. Z2.
G01 Z0 F0.1
X40. Z-30.
X44.
G00 X60. Z30.
M30
%
