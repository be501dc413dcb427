/* What this machine can do at best: fused multiply-adds from the widest registers, and memory read and written. */

#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifdef _OPENMP
#include <omp.h>
#endif

static double now(void)
{
  struct timespec t;
  timespec_get(&t, TIME_UTC);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Twelve chains that do not depend on each other: two units with a latency of four or five steps are kept busy, and
   sixteen registers hold them. x = x m + a converges to 1, so nothing overflows or becomes denormal. */
#define FMA_LOOP(name, width, attribute)                                                                              \
  attribute static double name(long steps)                                                                            \
  {                                                                                                                   \
    typedef double vector __attribute__((vector_size(width)));                                                        \
    const vector m = (vector){0} + 0.5, a = (vector){0} + 0.5;                                                        \
    vector x0 = m, x1 = m * 0.9, x2 = m * 0.8, x3 = m * 0.7, x4 = m * 0.6, x5 = m * 0.5;                              \
    vector x6 = m * 0.4, x7 = m * 0.3, x8 = m * 0.2, x9 = m * 0.1, x10 = m * 1.1, x11 = m * 1.2;                      \
    for (long i = 0; i < steps; ++i) {                                                                                \
      x0 = x0 * m + a; x1 = x1 * m + a; x2 = x2 * m + a; x3 = x3 * m + a; x4 = x4 * m + a; x5 = x5 * m + a;           \
      x6 = x6 * m + a; x7 = x7 * m + a; x8 = x8 * m + a; x9 = x9 * m + a; x10 = x10 * m + a; x11 = x11 * m + a;       \
    }                                                                                                                 \
    x0 = (x0 + x1) + (x2 + x3) + (x4 + x5) + (x6 + x7) + (x8 + x9) + (x10 + x11);                                     \
    double sum = 0;                                                                                                   \
    for (size_t i = 0; i < sizeof(vector) / sizeof(double); ++i) sum += x0[i];                                        \
    return sum;                                                                                                       \
  }
#define FLOPS_PER_STEP(width) (12.0 * 2.0 * (width) / sizeof(double))

FMA_LOOP(fma_16, 16, )
#ifdef __x86_64__
FMA_LOOP(fma_32, 32, __attribute__((target("avx2,fma"))))
FMA_LOOP(fma_64, 64, __attribute__((target("avx512f"))))
#endif

/* Floating-point operations a second, all threads together, with registers of `width` bytes: 16, 32 or 64.
   0 where the processor does not have them. */
double machine_peak(int width, int threads)
{
  double (*loop)(long) = NULL;
  if (width == 16) loop = fma_16;
#ifdef __x86_64__
  __builtin_cpu_init();
  if (width == 32 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) loop = fma_32;
  if (width == 64 && __builtin_cpu_supports("avx512f")) loop = fma_64;
#endif
  if (!loop) return 0;
  const long steps = 1000000;
  double best = 1e30, sum = 0;
  for (int repetition = 0; repetition < 12; ++repetition) {
    const double start = now();
#pragma omp parallel num_threads(threads) reduction(+ : sum)
    sum += loop(steps);
    const double taken = now() - start;
    if (taken < best) best = taken;
  }
#ifndef _OPENMP
  threads = 1;
#endif
  return sum > 0 ? FLOPS_PER_STEP(width) * (double)steps * threads / best : 0;
}

/* One pass over half of the memory as source and the other half as target. */
static void scale(double *to, const double *from, size_t n)
{
  for (size_t i = 0; i < n; ++i) to[i] = 0.5 * from[i];
}

static double timed_pass(double *to, const double *from, size_t n, int threads, long passes, int copy)
{
  const double start = now();
#pragma omp parallel num_threads(threads)
  {
    size_t first = 0, count = n;
#ifdef _OPENMP
    const size_t share = (n + (size_t)omp_get_num_threads() - 1) / (size_t)omp_get_num_threads();
    first = share * (size_t)omp_get_thread_num();
    if (first > n) first = n;
    count = n - first < share ? n - first : share;
#else
    (void)threads;
#endif
    for (long pass = 0; pass < passes; ++pass) {
      if (copy)
        memcpy(to + first, from + first, count * sizeof(double));
      else
        scale(to + first, from + first, count);
      __asm__ volatile("" ::: "memory");
    }
  }
  return (now() - start) / (double)passes;
}

/* Bytes read and written a second, all threads together, while `bytes` of memory are gone through again and again: the
   faster of a loop with ordinary stores and the C library's copy. 0 where there is no memory. */
double machine_bandwidth(size_t bytes, int threads)
{
  const size_t n = bytes / (2 * sizeof(double));
  double *memory = malloc((2 * n + 1) * sizeof(double));
  if (!memory || n == 0) {
    free(memory);
    return 0;
  }
  for (size_t i = 0; i < 2 * n; ++i) memory[i] = 1;
  double best = 1e30;
  for (int copy = 0; copy < 2; ++copy) {
    /* So many passes that waking the threads does not count. */
    long passes = 1;
    while (passes < (1L << 24) && timed_pass(memory + n, memory, n, threads, passes, copy) * (double)passes < 1e-3)
      passes *= 2;
    for (int repetition = 0; repetition < 8; ++repetition) {
      const double taken = timed_pass(memory + n, memory, n, threads, passes, copy);
      if (taken < best) best = taken;
    }
  }
  free(memory);
  return 2.0 * (double)n * sizeof(double) / best;
}

/* How many threads the sweeps of this process take from now on; returns the number in use. */
int machine_set_threads(int threads)
{
#ifdef _OPENMP
  omp_set_num_threads(threads);
  return omp_get_max_threads();
#else
  (void)threads;
  return 1;
#endif
}
