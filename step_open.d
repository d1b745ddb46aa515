step_open.o: src/step/step_open.cpp src/base/comm.h src/base/types.h \
 src/base/log.h src/base/timer.h src/contact/contact_masters.h \
 src/contact/contact_near.h src/base/box_tree.h src/model/state.h \
 src/model/domain_kinds.h src/model/model.h src/base/expr.h \
 src/base/halo.h src/model/element_table.h src/step/step.h \
 src/assem/assem.h src/dof/dof.h src/base/failure.h src/base/sum.h \
 src/dof/discretisation.h src/bond/bond.h src/contact/contact.h \
 src/elem/kernel.h src/mat/mat.h src/contact/contact_scene.h \
 src/contact/contact_meet.h src/contact/overlap.h src/elem/elem.h \
 src/elem/bar_form.h src/elem/kernel_general.h src/mat/law.h \
 src/mat/voigt.h src/model/quantity.h src/mat/split.h src/frac/frac.h \
 src/model/model_cut.h src/point/point.h src/point/corner_names.h \
 src/solve/solve.h src/out/out.h src/base/archive.h src/base/hash.h
src/base/comm.h:
src/base/types.h:
src/base/log.h:
src/base/timer.h:
src/contact/contact_masters.h:
src/contact/contact_near.h:
src/base/box_tree.h:
src/model/state.h:
src/model/domain_kinds.h:
src/model/model.h:
src/base/expr.h:
src/base/halo.h:
src/model/element_table.h:
src/step/step.h:
src/assem/assem.h:
src/dof/dof.h:
src/base/failure.h:
src/base/sum.h:
src/dof/discretisation.h:
src/bond/bond.h:
src/contact/contact.h:
src/elem/kernel.h:
src/mat/mat.h:
src/contact/contact_scene.h:
src/contact/contact_meet.h:
src/contact/overlap.h:
src/elem/elem.h:
src/elem/bar_form.h:
src/elem/kernel_general.h:
src/mat/law.h:
src/mat/voigt.h:
src/model/quantity.h:
src/mat/split.h:
src/frac/frac.h:
src/model/model_cut.h:
src/point/point.h:
src/point/corner_names.h:
src/solve/solve.h:
src/out/out.h:
src/base/archive.h:
src/base/hash.h:
