/* Whether this process is the child of a fork() after its parent had used several threads: the threads of OpenMP are not
   there in it, and a parallel region would wait for them for ever. */
#if defined(_WIN32)
int jointfrf_was_forked(void)
{
  return 0;
}

void jointfrf_watch_forks(void)
{
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
#endif
