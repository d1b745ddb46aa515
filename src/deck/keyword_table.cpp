#include "deck/keyword_table.h"

// one reader for each keyword, in kw_<keyword>.cpp
void kw_amplitude(Card&, Model&);
void kw_block(Card&, Model&);
void kw_bond(Card&, Model&);
void kw_boundary(Card&, Model&);
void kw_bulk_viscosity(Card&, Model&);
void kw_check(Card&, Model&);
void kw_cload(Card&, Model&);
void kw_contact(Card&, Model&);
void kw_contact_exclusions(Card&, Model&);
void kw_contact_file(Card&, Model&);
void kw_contact_inclusions(Card&, Model&);
void kw_contact_pair(Card&, Model&);
void kw_contact_print(Card&, Model&);
void kw_contact_property(Card&, Model&);
void kw_conversion(Card&, Model&);
void kw_coupling(Card&, Model&);
void kw_cylinder(Card&, Model&);
void kw_damping(Card&, Model&);
void kw_density(Card&, Model&);
void kw_dload(Card&, Model&);
void kw_dsload(Card&, Model&);
void kw_distributing(Card&, Model&);
void kw_drucker_prager(Card&, Model&);
void kw_drucker_prager_hardening(Card&, Model&);
void kw_dynamic(Card&, Model&);
void kw_eigenfracture(Card&, Model&);
void kw_el_file(Card&, Model&);
void kw_el_print(Card&, Model&);
void kw_elastic(Card&, Model&);
void kw_element(Card&, Model&);
void kw_elset(Card&, Model&);
void kw_end_step(Card&, Model&);
void kw_equation(Card&, Model&);
void kw_fragments(Card&, Model&);
void kw_friction(Card&, Model&);
void kw_ghost(Card&, Model&);
void kw_grid(Card&, Model&);
void kw_grid_boundary(Card&, Model&);
void kw_heading(Card&, Model&);
void kw_history(Card&, Model&);
void kw_hyperelastic(Card&, Model&);
void kw_include(Card&, Model&);
void kw_initial_conditions(Card&, Model&);
void kw_kinematic(Card&, Model&);
void kw_material(Card&, Model&);
void kw_material_points(Card&, Model&);
void kw_model_change(Card&, Model&);
void kw_newton(Card&, Model&);
void kw_node(Card&, Model&);
void kw_node_file(Card&, Model&);
void kw_node_print(Card&, Model&);
void kw_nset(Card&, Model&);
void kw_orientation(Card&, Model&);
void kw_parameter(Card&, Model&);
void kw_plastic(Card&, Model&);
void kw_restart(Card&, Model&);
void kw_rigid_body(Card&, Model&);
void kw_solid_section(Card&, Model&);
void kw_solver(Card&, Model&);
void kw_static(Card&, Model&);
void kw_step(Card&, Model&);
void kw_surface(Card&, Model&);
void kw_surface_behavior(Card&, Model&);
void kw_surface_interaction(Card&, Model&);
void kw_tie(Card&, Model&);
void kw_transform(Card&, Model&);
void kw_viscous_boundary(Card&, Model&);
void kw_vtk(Card&, Model&);

namespace {
const int OUTSIDE = IN_MODEL | AFTER_STEPS;
const int ANYWHERE = IN_MODEL | IN_STEP | AFTER_STEPS;
}

const Keyword keyword_table[] = {
    {"AMPLITUDE", kw_amplitude, ANYWHERE, "NAME!|TIME|DEFINITION|SHIFTX|SHIFTY",
     "function of time that scales loads and supports"},
    {"BLOCK", kw_block, IN_MODEL, "TYPE!|ELSET!|MERGE|EDGES",
     "structured mesh of a rectangle or box, with sets and surfaces of its sides"},
    {"BOND", kw_bond, IN_MODEL,
     "NAME!|SURFACE!|TYPE|BODY|INTERMEDIATE|LATTICE|PENALTY|ALPHA|AUGMENT|NORMAL|DOF|AMPLITUDE",
     "ties a surface to the grid of a body of material points, or to the ground"},
    {"BOUNDARY", kw_boundary, IN_MODEL | IN_STEP, "TYPE|AMPLITUDE|OP|TIME DELAY",
     "prescribed displacements or velocities of nodes"},
    {"BULK VISCOSITY", kw_bulk_viscosity, IN_STEP, "",
     "volumetric damping in motion, against oscillations behind shock fronts"},
    {"CHECK", kw_check, ANYWHERE, "TYPE!|SOURCE!|TIME|AT|SCALE|CENTRE",
     "expected value, its tolerance and its source"},
    {"CLOAD", kw_cload, IN_STEP, "AMPLITUDE|OP|TIME DELAY", "forces on nodes"},
    {"CONTACT", kw_contact, IN_MODEL, "NAME|INTERACTION|FRICTION|PENALTY|ALPHA|INTERMEDIATE|OVERLAP|ADJUST",
     "general contact: all outer faces, fragments and debris, against all"},
    {"CONTACT EXCLUSIONS", kw_contact_exclusions, IN_MODEL, "",
     "surfaces, element sets and bodies excluded from general contact"},
    {"CONTACT FILE", kw_contact_file, IN_STEP, "FREQUENCY|OUTPUT|GLOBAL",
     "requests VTK output of contact (CalculiX)"},
    {"CONTACT INCLUSIONS", kw_contact_inclusions, IN_MODEL, "ALL EXTERIOR",
     "pairs of general contact; default: everything"},
    {"CONTACT PAIR", kw_contact_pair, IN_MODEL,
     "NAME|INTERACTION|TYPE|FRICTION|PENALTY|ALPHA|INTERMEDIATE|AUGMENT|OVERLAP|ADJUST",
     "contact of two surfaces, penalty, Coulomb friction"},
    {"CONTACT PRINT", kw_contact_print, IN_STEP, "NSET|FREQUENCY|TOTALS",
     "accepted for decks of CalculiX; *HISTORY prints contact"},
    {"CONTACT PROPERTY ASSIGNMENT", kw_contact_property, IN_MODEL, "",
     "surface interaction of two sides of general contact"},
    {"CONVERSION", kw_conversion, IN_MODEL,
     "ELSET!|BODY|POINTS|FIELD|TRIGGER|LIMIT|TIME|RELEASE|INTERFACE|INTERMEDIATE|PENALTY|ALPHA",
     "elements that become material points during the run"},
    {"COUPLING", kw_coupling, IN_MODEL, "CONSTRAINT NAME!|REF NODE!|SURFACE!",
     "a surface and a reference node: *KINEMATIC or *DISTRIBUTING follows"},
    {"CYLINDER", kw_cylinder, IN_MODEL, "TYPE!|ELSET!|QUARTER|MERGE",
     "structured mesh of a solid cylinder, with sets and surfaces of its sides"},
    {"DAMPING", kw_damping, IN_MATERIAL, "ALPHA|BETA", "Rayleigh damping of a material in dynamic steps"},
    {"DENSITY", kw_density, IN_MATERIAL, "", "mass per volume of a material"},
    {"DISTRIBUTING", kw_distributing, IN_MODEL, "",
     "the reference node of *COUPLING follows the mean of the surface"},
    {"DLOAD", kw_dload, IN_STEP, "AMPLITUDE|OP|TIME DELAY",
     "pressure, traction, gravity and volume force on elements and bodies"},
    {"DSLOAD", kw_dsload, IN_STEP, "AMPLITUDE|OP|TIME DELAY", "pressure and traction on surfaces"},
    {"DRUCKER PRAGER", kw_drucker_prager, IN_MATERIAL, "SHEAR CRITERION|APEX",
     "plasticity of soil, rock and concrete: strength that grows with pressure, straight or curved"},
    {"DRUCKER PRAGER HARDENING", kw_drucker_prager_hardening, IN_MATERIAL, "TYPE",
     "yield stress over plastic strain of *DRUCKER PRAGER"},
    {"DYNAMIC", kw_dynamic, IN_STEP,
     "EXPLICIT|DIRECT|SCHEME|BETA|GAMMA|DISSIPATION|ALPHA|HAFTOL|HALFINC SCALE FACTOR|NOHAF|SOLVER|"
     "SCALE FACTOR|DIRECT USER CONTROL|FIXED TIME INCREMENTATION|ELEMENT BY ELEMENT|APPLICATION|INITIAL",
     "dynamic step, implicit or explicit"},
    {"EIGENFRACTURE", kw_eigenfracture, IN_MODEL,
     "ELSET|BODY|CRITERION|SOFTENING|TRACK|ESTIMATE|EPSILON|SPLIT|RESIDUAL|ANGLE|STIFFNESS|RELEASE|AVERAGE|"
     "ORDER|SPACING|INTERVAL|SPEED LIMIT|FALLBACK|START|TOLERANCE|WEIBULL|SEED",
     "elements that may break, their toughness and criterion"},
    {"EL FILE", kw_el_file, IN_STEP, "FREQUENCY|OUTPUT|POSITION|GLOBAL",
     "requests VTK output of element results (CalculiX)"},
    {"EL PRINT", kw_el_print, IN_STEP, "ELSET!|FREQUENCY|GLOBAL", "prints element results into the listing"},
    {"ELASTIC", kw_elastic, IN_MATERIAL, "TYPE", "Young's modulus and Poisson's ratio of a material"},
    {"ELEMENT", kw_element, IN_MODEL, "TYPE!|ELSET", "elements by label and nodes"},
    {"ELSET", kw_elset, IN_MODEL, "ELSET!|GENERATE|WHERE|INTERNAL|UNSORTED", "set of elements"},
    {"END STEP", kw_end_step, IN_STEP, "", "ends a step"},
    {"EQUATION", kw_equation, IN_MODEL | IN_STEP, "REMOVE|REMOVE ALL",
     "linear equations between displacements of nodes"},
    {"FRAGMENTS", kw_fragments, ANYWHERE, "FREQUENCY|TIME INTERVAL", "table of fragments"},
    {"FRICTION", kw_friction, IN_INTERACTION, "SLIP TOLERANCE", "Coulomb friction of a surface interaction"},
    {"GEOSTATIC", kw_static, IN_STEP, "", "static step, as *STATIC, for the stress of the ground"},
    {"GHOST", kw_ghost, IN_MODEL, "STIFFNESS|MASS",
     "ghost stabilisation of cells that are cut by the boundary of a body"},
    {"GRID", kw_grid, IN_MODEL, "WEAK|KEEP", "the box of equal cells that material points move through"},
    {"GRID BOUNDARY", kw_grid_boundary, OUTSIDE, "AMPLITUDE|FRICTION",
     "prescribed displacements of all grid nodes on a plane"},
    {"HEADING", kw_heading, ANYWHERE, "", "title of the run"},
    {"HISTORY", kw_history, ANYWHERE, "FREQUENCY", "columns of the history file (JOB.his)"},
    {"HYPERELASTIC", kw_hyperelastic, IN_MATERIAL, "NEO HOOKE", "neo-Hookean material: C10, D1"},
    {"INCLUDE", kw_include, ANYWHERE | IN_MATERIAL, "INPUT!", "reads another file at this point"},
    {"INITIAL CONDITIONS", kw_initial_conditions, IN_MODEL, "TYPE!|GEOSTATIC",
     "velocity, displacement, stress or cracks at the start of the run"},
    {"KINEMATIC", kw_kinematic, IN_MODEL, "",
     "the surface of *COUPLING follows the reference node as a rigid body"},
    {"MATERIAL", kw_material, IN_MODEL, "NAME!", "begins a material"},
    {"MATERIAL POINTS", kw_material_points, IN_MODEL,
     "BODY!|MATERIAL!|FILL|ELSET|POINTS|PLANE|THICKNESS|FIELD|WHERE|RESHAPE", "a body of material points"},
    {"MODEL CHANGE", kw_model_change, IN_MODEL | IN_STEP, "TYPE!|REMOVE|ADD",
     "elements removed from the start or in a step, and added again"},
    {"NEWTON", kw_newton, IN_MODEL | IN_STEP, "TOL FORCE|TOL ENERGY|MAX ITER|MAX CUT|LINE SEARCH",
     "tolerances of the iteration"},
    {"NODE", kw_node, IN_MODEL, "NSET", "nodes by label and coordinates"},
    {"NODE FILE", kw_node_file, IN_STEP, "FREQUENCY|OUTPUT|GLOBAL",
     "requests VTK output of nodal results (CalculiX)"},
    {"NODE PRINT", kw_node_print, IN_STEP, "NSET!|FREQUENCY|TOTALS|GLOBAL",
     "prints nodal results into the listing"},
    {"NSET", kw_nset, IN_MODEL, "NSET!|ELSET|GENERATE|WHERE|INTERNAL|UNSORTED", "set of nodes"},
    {"ORIENTATION", kw_orientation, IN_MODEL, "NAME!|SYSTEM", "directions of an orthotropic material"},
    {"PARAMETER", kw_parameter, ANYWHERE, "", "names for numbers: name = expression"},
    {"PLASTIC", kw_plastic, IN_MATERIAL, "HARDENING",
     "yield stress over plastic strain: von Mises plasticity, isotropic hardening"},
    {"RESTART", kw_restart, ANYWHERE, "READ|WRITE|FREQUENCY|TIME INTERVAL|OVERLAY",
     "files from which the run can be continued"},
    {"RIGID BODY", kw_rigid_body, IN_MODEL, "REF NODE!|ELSET!", "elements that move as one body"},
    {"SOLID SECTION", kw_solid_section, IN_MODEL, "ELSET!|MATERIAL!|ORIENTATION|MASS|OFFSET",
     "material, thickness and mass of elements"},
    {"SOLVER", kw_solver, OUTSIDE, "TYPE|REUSE|PRECONDITIONER", "the linear solver"},
    {"STATIC", kw_static, IN_STEP, "DIRECT|RIKS|SOLVER|STABILIZE|ALLSDTOL|CONTINUE|FACTOR", "static step"},
    {"STEP", kw_step, ANYWHERE, "NAME|NLGEOM|INC|EXTRAPOLATION|BALANCE", "begins a step"},
    {"SURFACE", kw_surface, IN_MODEL, "NAME!|TYPE|ELSET|WHERE|BODY|INTERNAL",
     "faces of elements or of a body of material points"},
    {"SURFACE BEHAVIOR", kw_surface_behavior, IN_INTERACTION, "PRESSURE-OVERCLOSURE!",
     "penalty of a surface interaction"},
    {"SURFACE INTERACTION", kw_surface_interaction, IN_MODEL, "NAME!",
     "begins a surface interaction, to which contact pairs refer"},
    {"TIE", kw_tie, IN_MODEL, "NAME!|POSITION TOLERANCE|ADJUST|TYPE",
     "ties two surfaces of elements whose faces do not match"},
    {"TRANSFORM", kw_transform, IN_MODEL, "NSET!|TYPE",
     "directions of *BOUNDARY, *CLOAD and *EQUATION at nodes"},
    {"VISCOUS BOUNDARY", kw_viscous_boundary, IN_MODEL, "",
     "dampers on surfaces that let waves leave the model"},
    {"VTK", kw_vtk, ANYWHERE, "FREQUENCY|TIME INTERVAL|FORMAT", "output for ParaView"},
};

const int keyword_count = static_cast<int>(sizeof keyword_table / sizeof keyword_table[0]);

const Keyword* keyword_find(const std::string& word)
{
  const std::string key = text_squeeze(word);
  for (const Keyword& k : keyword_table)
    if (key == text_squeeze(k.word)) return &k;
  return nullptr;
}
