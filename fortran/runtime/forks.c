/* Whether a parallel region would get its threads. In the child of a fork() after its parent had used several, the threads
   of OpenMP are not there, and the region would wait for them for ever. Where no more threads can be started, the run-time
   library of OpenMP ends the program. */
#if defined(_WIN32)
#include <stdint.h>
#include <windows.h>

int jointfrf_was_forked(void)
{
  return 0;
}

/* Windows has no fork(). FreeLibrary() must not take away the code that threads of OpenMP come back to. */
void jointfrf_watch_forks(void)
{
  HMODULE own;

  GetModuleHandleExA(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_PIN,
                     (const char *)(intptr_t)jointfrf_watch_forks, &own);
}

int jointfrf_can_start(int threads)
{
  return threads > 0;
}
#else
#include <pthread.h>

static pthread_once_t once = PTHREAD_ONCE_INIT;
static volatile int forked = 0;

static void in_child(void)
{
  forked = 1;
}

static void watch(void)
{
  pthread_atfork(0, 0, in_child);
}

int jointfrf_was_forked(void)
{
  return forked;
}

/* To be called before the first parallel region. */
void jointfrf_watch_forks(void)
{
  pthread_once(&once, watch);
}

/* Not allocated when it is first used: where there is no memory for that, the program would be ended. */
#if defined(__GNUC__) && defined(__ELF__)
#define AT_HAND __attribute__((tls_model("initial-exec")))
#else
#define AT_HAND
#endif
static _Thread_local AT_HAND int team = 1;     /* threads of this thread's last region, which OpenMP keeps for it */

static void *wait_for(void *gate)
{
  pthread_mutex_lock(gate);
  pthread_mutex_unlock(gate);
  return 0;
}

/* Whether so many threads, this one among them, can run at a time: those that OpenMP does not have yet are started, all
   together, and ended again. To be called before the region, outside of which nobody asks. */
int jointfrf_can_start(int threads)
{
  enum { most = 256 };     /* beyond that nobody is asked */
  pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
  pthread_t trial[most];
  const int wanted = threads - team < most ? threads - team : most;
  int started = 0, i;

  pthread_mutex_lock(&gate);
  while (started < wanted && pthread_create(&trial[started], 0, wait_for, &gate) == 0)
    started++;
  pthread_mutex_unlock(&gate);
  for (i = 0; i < started; i++)
    pthread_join(trial[i], 0);
  if (started < wanted)
    return 0;
  team = threads;
  return 1;
}
#endif
