// plate 100 x 100 mm with a notch from the left side and a hole of radius 10 above its line; for decks/hole.inp
//   gmsh -2 decks/hole.geo -o decks/hole_mesh.inp
DefineConstant[ h = 1.5 ];
SetFactory("Built-in");
Point(1) = {0, 0, 0, 2*h};   Point(2) = {100, 0, 0, 2*h}; Point(3) = {100, 100, 0, 2*h}; Point(4) = {0, 100, 0, 2*h};
Point(5) = {0, 50.5, 0, h};  Point(6) = {20, 50, 0, h};   Point(7) = {0, 49.5, 0, h};
Point(8) = {55, 62, 0, h};   Point(9) = {65, 62, 0, h};   Point(10) = {55, 72, 0, h};
Point(11) = {45, 62, 0, h};  Point(12) = {55, 52, 0, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 1};
Circle(8) = {9, 8, 10}; Circle(9) = {10, 8, 11}; Circle(10) = {11, 8, 12}; Circle(11) = {12, 8, 9};
Curve Loop(1) = {1 ... 7}; Curve Loop(2) = {8 ... 11};
Plane Surface(1) = {1, 2};
// the field of the mesh size: h where the crack runs
Field[1] = Box; Field[1].VIn = h; Field[1].VOut = 2*h; Field[1].Thickness = 20;
Field[1].XMin = 15; Field[1].XMax = 100; Field[1].YMin = 40; Field[1].YMax = 75;
Background Field = 1;
// names of sets in the deck
Physical Curve("BOTTOM") = {1};
Physical Curve("TOP") = {3};
Physical Surface("PLATE") = {1};
