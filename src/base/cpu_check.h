// ---------------------------------------------------------------------------
// cpu_check.h : does this processor have the vector instructions that the program was compiled for?
//
// cpu_check.cpp is compiled for the generic processor (Makefile) and runs before everything else, even before
// the constructors of global objects: a processor without the instructions would end the program by SIGILL,
// without a message. It uses nothing of the C++ library, whose inline functions might come from a file
// compiled for another processor.
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_CPU_CHECK_H
#define MPFE_BASE_CPU_CHECK_H

enum CpuPart : unsigned {
  CPU_SSE42 = 1,
  CPU_AVX = 2,
  CPU_AVX2 = 4,
  CPU_FMA = 8,
  CPU_BMI2 = 16,
  CPU_AVX512F = 32,
  CPU_AVX512BW = 64,
  CPU_AVX512DQ = 128,
  CPU_AVX512VL = 256,
  CPU_AVX512VBMI = 512
};

extern const unsigned cpu_built;       // parts that the compiler may use

#endif
