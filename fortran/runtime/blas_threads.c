/* The threads of the BLAS, whichever it is when a program is linked or loaded. The names that control them need not
   exist. With ELF they are weak, and null where the BLAS has none: the linker takes nothing out of a static libopenblas.a
   for their sake, and a program that links one and wants its threads held adds -Wl,-u,openblas_get_parallel. On macOS and
   Windows the names are looked up when the library is loaded; on Windows in the DLL that brings the LAPACK, so that the
   threads of a BLAS in a static library are not held. */
#include <stdint.h>

#ifdef __ELF__
#define OPTIONAL(symbol) __asm__(symbol) __attribute__((weak))
int openblas_get_parallel(void) OPTIONAL(JF_BLAS_PREFIX "openblas_get_parallel");
int openblas_get_num_threads(void) OPTIONAL(JF_BLAS_PREFIX "openblas_get_num_threads");
void openblas_set_num_threads(int threads) OPTIONAL(JF_BLAS_PREFIX "openblas_set_num_threads");
int mkl_set_local(int threads) OPTIONAL("MKL_Set_Num_Threads_Local");
int64_t blis_get(void) OPTIONAL("bli_thread_get_num_threads");
void blis_set(int64_t threads) OPTIONAL("bli_thread_set_num_threads");
#else
static int (*openblas_get_parallel)(void);
static int (*openblas_get_num_threads)(void);
static void (*openblas_set_num_threads)(int threads);
static int (*mkl_set_local)(int threads);
static int64_t (*blis_get)(void);
static void (*blis_set)(int64_t threads);

#ifdef _WIN32
#include <windows.h>
__declspec(dllimport) void lapack_routine(void) __asm__(JF_BLAS_PREFIX "zgetrf_");

static void *address_of(const char *name)
{
  HMODULE bringer = NULL;

  GetModuleHandleExA(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
                     (const char *)(intptr_t)lapack_routine, &bringer);
  return bringer == NULL ? NULL : (void *)(intptr_t)GetProcAddress(bringer, name);
}
#else
#include <dlfcn.h>

static void *address_of(const char *name)
{
  return dlsym(RTLD_DEFAULT, name);
}
#endif

__attribute__((constructor)) static void look_up(void)
{
  openblas_get_parallel = (int (*)(void))address_of(JF_BLAS_PREFIX "openblas_get_parallel");
  openblas_get_num_threads = (int (*)(void))address_of(JF_BLAS_PREFIX "openblas_get_num_threads");
  openblas_set_num_threads = (void (*)(int))address_of(JF_BLAS_PREFIX "openblas_set_num_threads");
  mkl_set_local = (int (*)(int))address_of("MKL_Set_Num_Threads_Local");
  blis_get = (int64_t (*)(void))address_of("bli_thread_get_num_threads");
  blis_set = (void (*)(int64_t))address_of("bli_thread_set_num_threads");
}
#endif

/* How an OpenBLAS was built. The count of one built on OpenMP is OpenMP's own and is left alone; it starts no threads in
   threads. One built without threads must not be called by two at once. */
enum { NO_THREADS = 0, OWN_THREADS = 1 };

/* Whether several threads may call the BLAS at once. */
int jointfrf_blas_takes_threads(void)
{
  return !openblas_get_parallel || openblas_get_parallel() != NO_THREADS;
}

/* How many threads the BLAS takes, if that is one number for the whole process; 1 where there is nothing to hold. */
int jointfrf_get_blas_threads(void)
{
  if (!openblas_get_parallel || !openblas_get_num_threads || !openblas_set_num_threads)
    return 1;
  return openblas_get_parallel() == OWN_THREADS ? openblas_get_num_threads() : 1;
}

/* Only after the number above was not 1. */
void jointfrf_set_blas_threads(int threads)
{
  openblas_set_num_threads(threads);
}

/* MKL has a number for each thread that calls it, where 0 stands for that of the process; threads of a parallel region
   get 1 from MKL itself. In BLIS the number belongs to the calling thread or to the process, as its version will; in the
   latter case another sweep that ends first lets go for all. Each thread puts back what it has changed itself. */
static _Thread_local int holds, mkl_before, blis_before;

void jointfrf_hold_own_blas_threads(void)
{
  if (holds++ > 0)
    return;
  if (mkl_set_local)
    mkl_before = mkl_set_local(1);
  blis_before = blis_get && blis_set ? (int)blis_get() : 1;
  if (blis_before > 1)
    blis_set(1);
}

void jointfrf_release_own_blas_threads(void)
{
  if (--holds > 0)
    return;
  if (mkl_set_local)
    mkl_set_local(mkl_before);
  if (blis_before > 1)
    blis_set(blis_before);
}
