#include "deck/deck_state.h"

// column_built_in : columns of every history file; column: spelling in the file
bool column_built_in(const std::string& name, std::string& column)
{
  for (const char* word : {"time", "step", "inc", "dt", "iter", "kinetic", "strain", "bond", "external",
                           "balance", "px", "py", "pz", "lx", "ly", "lz", "slip_max", "slip_rms"})
    if (text_upper(name) == text_upper(word)) {
      column = word;
      return true;
    }
  return false;
}
