#include "base/weibull.h"

#include <gsl/gsl_randist.h>
#include <gsl/gsl_sf_gamma.h>

#include <new>

#include "base/log.h"

RealVec weibull_draw(double modulus, double mean, int seed, const IntVec& at)
{
  gsl_rng* const rng = gsl_rng_alloc(gsl_rng_mt19937);
  if (!rng) throw std::bad_alloc();
  gsl_rng_set(rng, static_cast<unsigned long>(seed));
  const double scale = mean / gsl_sf_gamma(1.0 + 1.0 / modulus);
  RealVec out;
  double x  = mean;
  int drawn = 0;
  for (int k : at) {
    MPFE_CHECK(k >= drawn - 1, "positions of random numbers must ascend");
    for (; drawn <= k; ++drawn) x = gsl_ran_weibull(rng, scale, modulus);
    out.push_back(x);
  }
  gsl_rng_free(rng);
  return out;
}
