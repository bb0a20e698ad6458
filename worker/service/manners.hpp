// How a worker shares a machine with others: last in line for processor and disk, and within a
// limit of memory.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.hpp"

namespace pvsfarm {

// For the whole process: nice 19, and the disk when nobody else wants it. Linux weighs sessions
// against each other before it weighs niceness (autogroup); the session's weight is lowered too if
// this process leads it, else only `note` says so. Call it before threads are made.
void step_back(std::string& note);
// For the calling thread: processor time that nobody else wants. Not for a thread that must answer.
void run_when_idle();

// Memory that the process may have of its own; what it maps of files, as a scene, does not count.
// Beyond it allocations fail. Errors: kRuntime (not permitted).
Status limit_memory(std::uint64_t bytes);

}  // namespace pvsfarm
