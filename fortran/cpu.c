/* What Fortran has no word for: which instruction sets the processor has, asking for memory before it is needed, and
   reading the environment without memory of its own. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#endif

/* 2, 3 or 4 for x86-64-v2, -v3 or -v4; 0 for less and for other processors. The operating system's support of the wide
   registers is part of the answer. */
int jointfrf_cpu_level(void)
{
#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
  __builtin_cpu_init();
  if (!(__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("ssse3") && __builtin_cpu_supports("popcnt")))
    return 0;
  if (!(__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi")
        && __builtin_cpu_supports("bmi2")))
    return 2;
  if (!(__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd")
        && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")))
    return 3;
  return 4;
#else
  return 0;
#endif
}

/* Begin to bring the bytes from `from` to before `to` near, to be read or, with `write`, to be overwritten. A hint: no
   address is wrong. */
void jointfrf_prefetch(intptr_t from, intptr_t to, int write)
{
#if defined(__GNUC__) || defined(__clang__)
  if (write)
    for (; from < to; from += 64)
      __builtin_prefetch((const void *)from, 1, 2);
  else
    for (; from < to; from += 64)
      __builtin_prefetch((const void *)from, 0, 2);
#else
  (void)from;
  (void)to;
  (void)write;
#endif
}

/* On Windows each C library has a copy of the environment of its own; that of the process is what the others write to. */
void jointfrf_read_engine(int length, char *word)
{
#ifdef _WIN32
  char value[32];
  const size_t used = GetEnvironmentVariableA("JOINTFRF_ENGINE", value, sizeof value);
#else
  const char *value = getenv("JOINTFRF_ENGINE");
  const size_t used = value == NULL ? 0 : strlen(value);
#endif

  memset(word, used > (size_t)length ? '?' : ' ', (size_t)length);
  if (used > 0 && used <= (size_t)length)
    memcpy(word, value, used);
}
