// ---------------------------------------------------------------------------
// failure.h : the result of a routine of the physics: status, and location and reason of a failure
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_FAILURE_H
#define MPFE_BASE_FAILURE_H

#include <utility>

#include "base/types.h"

enum FailureAt { AT_NOTHING, AT_ELEMENT, AT_POINT, AT_CORNER, AT_BOND };

// Returned by value; success costs nothing. step_explain formulates the message.
struct Failure {
  Status status = STATUS_OK;
  FailureAt at  = AT_NOTHING;
  int index     = -1;          // element, point, corner or bond
  std::string note;            // the reason, if status and index do not show it

  Failure(Status s = STATUS_OK) : status(s) {}
  Failure(Status s, FailureAt where, int which) : status(s), at(where), index(which) {}
  Failure(Status s, std::string why) : status(s), note(std::move(why)) {}
  bool ok() const { return status == STATUS_OK; }
};

// failure_agree : the failure of the first rank that has one, on all ranks; its index is valid on that rank
// only. Collective.
Failure failure_agree(const Failure& own);

#endif
