// What a C++ program with Eigen does with one matrix after the other, for orders that are known when it is compiled.
//
// ORDERS is a list X(1) X(2) ... of them. Matrices lie row by row, one line after the other. Each function returns 0,
// or 1 where there is nothing for such an order.
#include <Eigen/Dense>
#include <complex>

using number = std::complex<double>;

template <int rows, int columns>
using matrix = Eigen::Matrix<number, rows, columns, columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;

template <int rows, int columns> Eigen::Map<const matrix<rows, columns>> line_of(const number *a, long line)
{
  return Eigen::Map<const matrix<rows, columns>>(a + line * rows * columns);
}

template <int rows, int columns> Eigen::Map<matrix<rows, columns>> line_of(number *a, long line)
{
  return Eigen::Map<matrix<rows, columns>>(a + line * rows * columns);
}

template <int n> void invert(long lines, const number *a, number *x)
{
  for (long i = 0; i < lines; ++i) line_of<n, n>(x, i) = line_of<n, n>(a, i).inverse();
}

template <int n, int columns> void solve(long lines, const number *a, const number *b, number *x)
{
  for (long i = 0; i < lines; ++i)
    line_of<n, columns>(x, i) = line_of<n, n>(a, i).partialPivLu().solve(line_of<n, columns>(b, i));
}

// K* = K0 - (alpha^-1 (alpha - gamma) gamma^-1)_jk, (2.47): two inverses and two products.
template <int n> void ismm(long lines, const number *alpha, const number *gamma, const number *k, number *x)
{
  for (long i = 0; i < lines; ++i) {
    const auto one = line_of<2 * n, 2 * n>(alpha, i), other = line_of<2 * n, 2 * n>(gamma, i);
    const matrix<2 * n, 2 * n> left = one.inverse(), right = other.inverse(), change = one - other;
    const matrix<2 * n, n> columns = change * right.template rightCols<n>();
    line_of<n, n>(x, i) = line_of<n, n>(k, i) - left.template topRows<n>() * columns;
  }
}

extern "C" int eigen_invert(int n, long lines, const number *a, number *x)
{
  switch (n) {
#define X(order) case order: invert<order>(lines, a, x); return 0;
    ORDERS
#undef X
  }
  return 1;
}

extern "C" int eigen_solve(int n, int columns, long lines, const number *a, const number *b, number *x)
{
  switch (n) {
#define X(order)                                                    \
  case order:                                                       \
    if (columns == 1) { solve<order, 1>(lines, a, b, x); return 0; } \
    if (columns == order) { solve<order, order>(lines, a, b, x); return 0; } \
    return 1;
    ORDERS
#undef X
  }
  return 1;
}

extern "C" int eigen_ismm(int n, long lines, const number *alpha, const number *gamma, const number *k, number *x)
{
  switch (n) {
#define X(order) case order: ismm<order>(lines, alpha, gamma, k, x); return 0;
    ORDERS
#undef X
  }
  return 1;
}

extern "C" int eigen_version() { return 10000 * EIGEN_WORLD_VERSION + 100 * EIGEN_MAJOR_VERSION + EIGEN_MINOR_VERSION; }
