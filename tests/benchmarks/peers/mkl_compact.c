/* MKL's compact routines: several matrices side by side in the vector registers, as many as their width holds. Lines
   are packed from C order, computed, and unpacked, a run of them at a time that stays in the second cache. The
   factorisation has no row exchanges, and the result no condition number. */

#include <complex.h>
#include <stdio.h>
#include <stdlib.h>

typedef double _Complex number;

/* As in mkl_compact.h and mkl_types.h. */
enum { ROWS = 101, NO_TRANSPOSE = 111, UPPER = 121, LOWER = 122, NOT_UNIT = 131, UNIT = 132, LEFT = 141 };
int mkl_zget_size_compact(int ld, int sd, int format, int nm);
void mkl_zgepack_compact(int layout, int rows, int columns, const number *const *a, int lda, double *ap, int ldap,
                         int format, int nm);
void mkl_zgeunpack_compact(int layout, int rows, int columns, number *const *a, int lda, const double *ap, int ldap,
                           int format, int nm);
void mkl_zgetrfnp_compact(int layout, int m, int n, double *ap, int ldap, int *info, int format, int nm);
void mkl_zgetrinp_compact(int layout, int n, double *ap, int ldap, double *work, int lwork, int *info, int format,
                          int nm);
void mkl_ztrsm_compact(int layout, int side, int uplo, int transposed, int diagonal, int m, int n, const void *alpha,
                       const double *ap, int ldap, double *bp, int ldbp, int format, int nm);
struct version { int major, minor, update; char *status, *build, *processor, *platform; };
void mkl_get_version(struct version *version);

/* Registers of 128, 256 or 512 bits. MKL's own advice goes by the maker of the processor, not by its registers. */
enum { FORMAT_128 = 181, FORMAT_256, FORMAT_512 };
static int format = FORMAT_128;

/* Use registers of so many bits from now on; returns 1 where the processor does not have them. */
int compact_use(int bits)
{
  int known = bits == 128;
#ifdef __x86_64__
  __builtin_cpu_init();
  if (bits == 256) known = __builtin_cpu_supports("avx2");
  if (bits == 512) known = __builtin_cpu_supports("avx512f");
#endif
  if (known) format = bits == 512 ? FORMAT_512 : bits == 256 ? FORMAT_256 : FORMAT_128;
  return !known;
}

static void *aligned(size_t bytes) { return aligned_alloc(64, (bytes + 63) / 64 * 64); }

enum { WORKSPACE = 262144 };

/* Matrices of one run: a multiple of every width. */
static int run_length(int numbers, long lines)
{
  long run = WORKSPACE / (16L * numbers) / 16 * 16;
  if (run < 16) run = 16;
  return (int)(run < lines ? run : lines);
}

/* x(line) = the inverse of a(line), shape (n_freq, n, n). Returns 0, or -1 without memory. */
int compact_invert(int n, long n_freq, const number *a, number *x)
{
  const int run = run_length(n * n, n_freq);
  int info = 0, length = -1;
  double wanted = 0;
  double *packed = aligned((size_t)mkl_zget_size_compact(n, n, format, run));
  mkl_zgetrinp_compact(ROWS, n, packed, n, &wanted, length, &info, format, run);
  length = (int)wanted;
  double *work = aligned(sizeof(double) * (size_t)(length > 0 ? length : 1));
  const number **from = malloc((size_t)run * sizeof *from);
  number **to = malloc((size_t)run * sizeof *to);
  const int good = packed && work && from && to;
  for (long first = 0; good && first < n_freq; first += run) {
    const int here = (int)(n_freq - first < run ? n_freq - first : run);
    for (int i = 0; i < here; ++i) {
      from[i] = a + (first + i) * n * n;
      to[i] = x + (first + i) * n * n;
    }
    mkl_zgepack_compact(ROWS, n, n, from, n, packed, n, format, here);
    mkl_zgetrfnp_compact(ROWS, n, n, packed, n, &info, format, here);
    mkl_zgetrinp_compact(ROWS, n, packed, n, work, length, &info, format, here);
    mkl_zgeunpack_compact(ROWS, n, n, to, n, packed, n, format, here);
  }
  free(packed);
  free(work);
  free(from);
  free(to);
  return good ? 0 : -1;
}

/* a(line) x(line) = b(line), shapes (n_freq, n, n) and (n_freq, n, m). Returns 0, or -1 without memory. */
int compact_solve(int n, int m, long n_freq, const number *a, const number *b, number *x)
{
  const int run = run_length(n * (n + m), n_freq);
  const number one = 1;
  int info = 0;
  double *factors = aligned((size_t)mkl_zget_size_compact(n, n, format, run));
  double *right = aligned((size_t)mkl_zget_size_compact(m, n, format, run));
  const number **a_line = malloc((size_t)run * sizeof *a_line), **b_line = malloc((size_t)run * sizeof *b_line);
  number **x_line = malloc((size_t)run * sizeof *x_line);
  const int good = factors && right && a_line && b_line && x_line;
  for (long first = 0; good && first < n_freq; first += run) {
    const int here = (int)(n_freq - first < run ? n_freq - first : run);
    for (int i = 0; i < here; ++i) {
      a_line[i] = a + (first + i) * n * n;
      b_line[i] = b + (first + i) * n * m;
      x_line[i] = x + (first + i) * n * m;
    }
    mkl_zgepack_compact(ROWS, n, n, a_line, n, factors, n, format, here);
    mkl_zgepack_compact(ROWS, n, m, b_line, m, right, m, format, here);
    mkl_zgetrfnp_compact(ROWS, n, n, factors, n, &info, format, here);
    mkl_ztrsm_compact(ROWS, LEFT, LOWER, NO_TRANSPOSE, UNIT, n, m, &one, factors, n, right, m, format, here);
    mkl_ztrsm_compact(ROWS, LEFT, UPPER, NO_TRANSPOSE, NOT_UNIT, n, m, &one, factors, n, right, m, format, here);
    mkl_zgeunpack_compact(ROWS, n, m, x_line, m, right, m, format, here);
  }
  free(factors);
  free(right);
  free(a_line);
  free(b_line);
  free(x_line);
  return good ? 0 : -1;
}

/* Version of MKL and what it takes the processor for. */
void mkl_name(char *text, size_t length)
{
  struct version v;
  mkl_get_version(&v);
  snprintf(text, length, "MKL %d.%d, kernels for %s", v.major, v.update, v.processor);
}
