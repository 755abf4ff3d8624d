// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// VESTIGE_CPU_DISPATCH before a function: compiled for several processors, chosen when it is
/// loaded. Only for what gives the same bits on all of them. Sanitizers do not support it.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define VESTIGE_CPU_DISPATCH __attribute__((target_clones("avx2", "default")))
#else
#define VESTIGE_CPU_DISPATCH
#endif
#define VESTIGE_INLINE inline __attribute__((always_inline))
