/* A plug-in that called the kernel with several threads is unloaded: the threads of OpenMP that it leaves, and what
   fork() calls, still find their code.

   unload LIBRARY   the shared library */
#define _DEFAULT_SOURCE
#include <complex.h>
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#define N 20
#define LINES 500
#ifndef INTEGER
#define INTEGER int
#endif

typedef INTEGER integer;
typedef void (*inverse)(const integer *, const integer *, const double complex *, double complex *, integer *, double *,
                        integer *);

static int use(const char *path)
{
    static double complex a[N * N * LINES], b[N * N * LINES];
    static double rcond[LINES];
    static integer line_info[LINES];
    const integer n = N, lines = LINES;
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    inverse invert;
    integer info = -1;
    int i;

    if (library == NULL) {
        fprintf(stderr, "FAILED: %s\n", dlerror());
        return 1;
    }
    *(void **)&invert = dlsym(library, "jf_invert_");
    for (i = 0; i < N * N * LINES; i++)
        a[i] = i % (N * N) % (N + 1) == 0 ? 4.0 : 1.0 / (1 + i % 7);
    if (invert != NULL)
        invert(&n, &lines, a, b, line_info, rcond, &info);
    if (dlclose(library) != 0 || info != 0) {
        fprintf(stderr, "FAILED: info %d\n", (int)info);
        return 1;
    }
    usleep(300000);      /* threads that wait actively now sleep */
    return 0;
}

int main(int argc, char **argv)
{
    int turn, status, failed = 0;

    if (argc != 2)
        return 2;
    for (turn = 0; turn < 3 && !failed; turn++) {
        pid_t child;

        failed = use(argv[1]);
        child = fork();
        if (child == 0)
            _exit(0);
        if (child < 0 || waitpid(child, &status, 0) < 0 || status != 0) {
            fprintf(stderr, "FAILED: fork() after the library was unloaded\n");
            failed = 1;
        }
    }
    return failed;
}
