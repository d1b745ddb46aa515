#include "base/cpu_check.h"

#if defined(__x86_64__)

#include <string.h>
#include <unistd.h>

namespace {

const int EXIT_NO_CPU = 5;     // EXIT_RESOURCE; types.h brings the C++ library

struct Part {
  unsigned bit;
  const char* name;
};

const Part parts[] = {
    {CPU_SSE42, " SSE4.2"},       {CPU_AVX, " AVX"},
    {CPU_AVX2, " AVX2"},          {CPU_FMA, " FMA"},
    {CPU_BMI2, " BMI2"},          {CPU_AVX512F, " AVX-512F"},
    {CPU_AVX512BW, " AVX-512BW"}, {CPU_AVX512DQ, " AVX-512DQ"},
    {CPU_AVX512VL, " AVX-512VL"}, {CPU_AVX512VBMI, " AVX-512VBMI"},
};

unsigned processor()
{
  __builtin_cpu_init();
  unsigned has = 0;
  if (__builtin_cpu_supports("sse4.2")) has |= CPU_SSE42;
  if (__builtin_cpu_supports("avx")) has |= CPU_AVX;
  if (__builtin_cpu_supports("avx2")) has |= CPU_AVX2;
  if (__builtin_cpu_supports("fma")) has |= CPU_FMA;
  if (__builtin_cpu_supports("bmi2")) has |= CPU_BMI2;
  if (__builtin_cpu_supports("avx512f")) has |= CPU_AVX512F;
  if (__builtin_cpu_supports("avx512bw")) has |= CPU_AVX512BW;
  if (__builtin_cpu_supports("avx512dq")) has |= CPU_AVX512DQ;
  if (__builtin_cpu_supports("avx512vl")) has |= CPU_AVX512VL;
  if (__builtin_cpu_supports("avx512vbmi")) has |= CPU_AVX512VBMI;
  return has;
}

void say(const char* text)
{
  if (write(STDERR_FILENO, text, strlen(text)) < 0) return;    // no reader
}

__attribute__((constructor(101))) void look()
{
  const unsigned missing = cpu_built & ~processor();
  if (!missing) return;
  say("ERROR  this program was compiled for another processor; here the instructions are missing that it "
      "uses:");
  for (const Part& p : parts)
    if (missing & p.bit) say(p.name);
  say(".\n  Build it again on this machine, or for a common processor: make MARCH=x86-64-v3 (AVX2), or make "
      "MARCH=x86-64 (any)\n");
  _exit(EXIT_NO_CPU);
}

}  // namespace

#endif
