// What the fault table of docs/reliability.md is made of: every test of a fault says there what was
// asked and what was reached. docs/make_reliability.sh runs the tests and makes the page.
#pragma once

#include <string>

namespace pvsfarm {

// Long runs: the counts that the table asks for. PVSFARM_FULL=1
bool full_counts();

struct FaultFigure {
  int row = 0;          // of the table
  std::string what;     // "results lost of 500 cells, 50 workers killed"
  std::string asked;    // "0"
  std::string reached;  // "0"
  bool held = false;
};

// Appends a line of JSON to the file that PVSFARM_FIGURES names; without it, does nothing. The line
// also says whether the counts were full ones, and which program it was.
void record(const FaultFigure& figure);

}  // namespace pvsfarm
