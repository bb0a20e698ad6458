// That a door which asks for keys keeps strangers out: tried before it is used, since libzmq lets
// everybody in where a part is missing.
#pragma once

#include <string>

#include "common/base/result.hpp"
#include "common/wire/keys.hpp"

namespace pvsfarm {

// That a key which is on no list is refused at `endpoint`, and a peer that has none.
// Errors: kRuntime, one was let in, or nothing could be learnt within seconds.
Status try_in_vain(const std::string& endpoint, const KeyBytes& server);

// A door of this machine, with parts left out, for the test that the trial notices.
struct TrialDoor {
  bool answers = true;   // somebody answers whether a key may come in: none may
  bool enforces = true;  // nobody comes in without an answer
};
Status try_in_vain(const TrialDoor& door);

}  // namespace pvsfarm
