// Unit tests, also on several ranks (unit/run_ranks)
#include <gtest/gtest.h>

#include "base/comm.h"

int main(int argc, char** argv)
{
  testing::InitGoogleTest(&argc, argv);
  comm_open(&argc, &argv);
  const int code = RUN_ALL_TESTS();
  comm_close();
  return code;
}
