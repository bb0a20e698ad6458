// Run-time dispatch: the hot loops are compiled for several instruction sets, and the loader picks
// one. They only add, multiply, compare and convert, without contraction, so every version gives
// the same bits, and a store does not depend on who computed it.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(PVSFARM_ONE_TARGET) && !defined(__SANITIZE_ADDRESS__) &&  \
    !defined(__SANITIZE_THREAD__)
#define PVSFARM_DISPATCH \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define PVSFARM_DISPATCH
#endif
