elem_stable.o: src/elem/elem_stable.cpp src/elem/elem.h \
 src/elem/bar_form.h src/elem/kernel_general.h src/elem/kernel.h \
 src/mat/mat.h src/model/model.h src/base/expr.h src/base/halo.h \
 src/base/comm.h src/base/types.h src/base/log.h \
 src/model/element_table.h src/mat/law.h src/mat/voigt.h \
 src/model/quantity.h src/model/state.h src/model/domain_kinds.h \
 src/mat/split.h
src/elem/elem.h:
src/elem/bar_form.h:
src/elem/kernel_general.h:
src/elem/kernel.h:
src/mat/mat.h:
src/model/model.h:
src/base/expr.h:
src/base/halo.h:
src/base/comm.h:
src/base/types.h:
src/base/log.h:
src/model/element_table.h:
src/mat/law.h:
src/mat/voigt.h:
src/model/quantity.h:
src/model/state.h:
src/model/domain_kinds.h:
src/mat/split.h:
