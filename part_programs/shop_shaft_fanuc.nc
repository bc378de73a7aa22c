%
O1001 (dialect: fanuc)
(Shaft: roughed with G71, finished with G70)
(Face of the part at Z0, chuck at smaller Z, X is a diameter)
G21 G18 G40 G80 G99
T0101
G50 S2500
G96 S180 M03
M08
G00 X42. Z2.
G71 U2. R0.5
G71 P10 Q20 U0.4 W0.1 F0.25
N10 G00 X18.
G01 Z0 F0.12
X20. Z-1.
Z-20.
X28.
G03 X30. Z-21. R1.
G01 Z-35.
G02 X34. Z-37. R2.
G01 X38.
N20 X42.
T0202
G96 S220 M03
G70 P10 Q20
G00 X60. Z30.
M09
M30
%
