#pragma once

// Internal to kernels/schedule: loops over lanes are compiled twice, with four lanes an instruction
// where the processor has AVX2; the same operations in the same order, so the same bits.
// SMOOTHPOST_LANES stands before such a function, SMOOTHPOST_INLINE before what it calls.
// Sanitizers do not bear the dispatch.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SMOOTHPOST_LANES __attribute__((target_clones("avx2", "default")))
#else
#define SMOOTHPOST_LANES
#endif
#define SMOOTHPOST_INLINE inline __attribute__((always_inline))
