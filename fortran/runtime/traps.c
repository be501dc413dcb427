/* Floating-point traps and rounding of the caller's thread, held off and put back: what ieee_get_status,
   ieee_set_halting_mode, ieee_set_rounding_mode and ieee_set_status do, in a fraction of their time. Overflow gives Inf,
   by which a bad line is known, only where numbers are rounded to the nearest. */
#include <fenv.h>
#include <stdint.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

typedef struct {
  int64_t room[8];
} host_state;

#if defined(__x86_64__)
/* Nothing here computes in the old x87 unit, whose state takes ten times as long to read and write, nor does what is called
   of LAPACK, but for eigenvalues: see below. */
enum { raised = 0x003f, masked = 0x1f80, rounding = 0x6000 };

void jointfrf_hold_traps(host_state *host)
{
  const unsigned state = _mm_getcsr();

  host->room[0] = state;
  if ((state & (masked | rounding)) != masked)
    _mm_setcsr((state | masked) & ~(unsigned)(raised | rounding));
}

void jointfrf_release_traps(const host_state *host)
{
  const unsigned state = (unsigned)host->room[0];

  if (_mm_getcsr() != state)
    _mm_setcsr(state);
}
#else

void jointfrf_hold_traps(host_state *host)
{
  feholdexcept((fenv_t *)host);
  fesetround(FE_TONEAREST);
}

void jointfrf_release_traps(const host_state *host)
{
  fesetenv((const fenv_t *)host);
}
#endif

_Static_assert(sizeof(fenv_t) <= sizeof(host_state), "a floating-point environment must fit into its room");

/* The same of all units: norms of OpenBLAS are computed in the old one. */
void jointfrf_hold_all_traps(host_state *host)
{
  feholdexcept((fenv_t *)host);
  fesetround(FE_TONEAREST);
}

void jointfrf_release_all_traps(const host_state *host)
{
  fesetenv((const fenv_t *)host);
}
