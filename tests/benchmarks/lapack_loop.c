/* The bare loop over LAPACK that a program without jointfrf would have: one line after the other, no condition number,
   no search for NaN, no names for bad lines. */

#include <complex.h>
#include <stdlib.h>
#include <string.h>

typedef double _Complex number;

#define PASTE(a, b) a##b
#define EXPAND(a, b) PASTE(a, b)
#define LAPACK(name) EXPAND(JF_BLAS_SYMBOL_PREFIX, name)

void LAPACK(zgetrf_)(const int *m, const int *n, number *a, const int *lda, int *pivot, int *info);
void LAPACK(zgetri_)(const int *n, number *a, const int *lda, const int *pivot, number *work, const int *lwork, int *info);
void LAPACK(zgesv_)(const int *n, const int *nrhs, number *a, const int *lda, int *pivot, number *b, const int *ldb, int *info);

/* x(line) = the inverse of a(line), shape (n_freq, n, n). Returns the number of bad lines, -1 without memory. */
int loop_invert(int n, long n_freq, const number *a, number *x)
{
  const int room = 32 * n;
  const size_t size = (size_t)n * (size_t)n;
  int *pivot = malloc((size_t)n * sizeof(int));
  number *work = malloc((size_t)room * sizeof(number));
  int bad = pivot && work ? 0 : -1;
  for (long i = 0; i < n_freq && bad >= 0; ++i) {
    number *line = x + (size_t)i * size;
    int info;
    memcpy(line, a + (size_t)i * size, size * sizeof(number));
    LAPACK(zgetrf_)(&n, &n, line, &n, pivot, &info);
    if (info == 0) LAPACK(zgetri_)(&n, line, &n, pivot, work, &room, &info);
    bad += info != 0;
  }
  free(pivot);
  free(work);
  return bad;
}

/* a(line) x(line) = b(line), shapes (n_freq, n, n) and (n_freq, n, m) in C order. */
int loop_solve(int n, int m, long n_freq, const number *a, const number *b, number *x)
{
  const size_t rows = (size_t)n, columns = (size_t)m;
  int *pivot = malloc(rows * sizeof(int));
  number *factors = malloc(rows * rows * sizeof(number)), *right = malloc(rows * columns * sizeof(number));
  int bad = pivot && factors && right ? 0 : -1;
  for (long line = 0; line < n_freq && bad >= 0; ++line) {
    const number *a_line = a + (size_t)line * rows * rows, *b_line = b + (size_t)line * rows * columns;
    number *x_line = x + (size_t)line * rows * columns;
    int info;
    for (size_t i = 0; i < rows; ++i) {
      for (size_t j = 0; j < rows; ++j) factors[j * rows + i] = a_line[i * rows + j];
      for (size_t j = 0; j < columns; ++j) right[j * rows + i] = b_line[i * columns + j];
    }
    LAPACK(zgesv_)(&n, &m, factors, &n, pivot, right, &n, &info);
    bad += info != 0;
    for (size_t i = 0; i < rows; ++i)
      for (size_t j = 0; j < columns; ++j) x_line[i * columns + j] = right[j * rows + i];
  }
  free(pivot);
  free(factors);
  free(right);
  return bad;
}
