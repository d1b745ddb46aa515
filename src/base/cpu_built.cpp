// Vector instructions that the program was compiled for, as data: this file is compiled like all others, but
// contains no code.
#include "base/cpu_check.h"

extern const unsigned cpu_built = 0
#ifdef __SSE4_2__
  | CPU_SSE42
#endif
#ifdef __AVX__
  | CPU_AVX
#endif
#ifdef __AVX2__
  | CPU_AVX2
#endif
#ifdef __FMA__
  | CPU_FMA
#endif
#ifdef __BMI2__
  | CPU_BMI2
#endif
#ifdef __AVX512F__
  | CPU_AVX512F
#endif
#ifdef __AVX512BW__
  | CPU_AVX512BW
#endif
#ifdef __AVX512DQ__
  | CPU_AVX512DQ
#endif
#ifdef __AVX512VL__
  | CPU_AVX512VL
#endif
#ifdef __AVX512VBMI__
  | CPU_AVX512VBMI
#endif
  ;
