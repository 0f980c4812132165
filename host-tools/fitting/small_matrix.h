// SPDX-License-Identifier: MIT
// Matrices of a few rows and columns, of compile-time size, for the inner loop of a filter. The
// compiler unrolls these plain loops; fixed-size expressions of Eigen run as fast but compile ten
// times as long.
#pragma once

namespace compbox::fitting {

template <int Rows, int Columns>
struct small_matrix {
    double row[Rows][Columns] = {};  // zero by default

    double &operator()(int i, int k) { return row[i][k]; }
    double operator()(int i, int k) const { return row[i][k]; }

    static small_matrix identity() {
        static_assert(Rows == Columns);
        small_matrix one;
        for (int i = 0; i < Rows; ++i) one(i, i) = 1.0;
        return one;
    }
};

template <int Rows, int Columns>
small_matrix<Rows, Columns> &operator+=(small_matrix<Rows, Columns> &a,
                                        const small_matrix<Rows, Columns> &b) {
    for (int i = 0; i < Rows; ++i) {
        for (int k = 0; k < Columns; ++k) a(i, k) += b(i, k);
    }
    return a;
}

template <int Rows, int Columns>
small_matrix<Rows, Columns> operator+(small_matrix<Rows, Columns> a,
                                      const small_matrix<Rows, Columns> &b) {
    return a += b;
}

template <int Rows, int Columns>
small_matrix<Rows, Columns> operator*(small_matrix<Rows, Columns> a, double factor) {
    for (auto &row : a.row) {
        for (double &value : row) value *= factor;
    }
    return a;
}

template <int Rows, int Columns>
small_matrix<Rows, Columns> operator-(const small_matrix<Rows, Columns> &a,
                                      const small_matrix<Rows, Columns> &b) {
    return a + b * -1.0;
}

template <int Rows, int Inner, int Columns>
small_matrix<Rows, Columns> operator*(const small_matrix<Rows, Inner> &a,
                                      const small_matrix<Inner, Columns> &b) {
    small_matrix<Rows, Columns> product;
    for (int i = 0; i < Rows; ++i) {
        for (int j = 0; j < Inner; ++j) {
            for (int k = 0; k < Columns; ++k) product(i, k) += a(i, j) * b(j, k);
        }
    }
    return product;
}

template <int Rows, int Columns>
small_matrix<Columns, Rows> transposed(const small_matrix<Rows, Columns> &a) {
    small_matrix<Columns, Rows> result;
    for (int i = 0; i < Rows; ++i) {
        for (int k = 0; k < Columns; ++k) result(k, i) = a(i, k);
    }
    return result;
}

template <int Rows, int Columns>
small_matrix<1, Columns> row_of(const small_matrix<Rows, Columns> &a, int i) {
    small_matrix<1, Columns> row;
    for (int k = 0; k < Columns; ++k) row(0, k) = a(i, k);
    return row;
}

template <int Rows, int Columns>
small_matrix<Rows, 1> column_of(const small_matrix<Rows, Columns> &a, int k) {
    small_matrix<Rows, 1> column;
    for (int i = 0; i < Rows; ++i) column(i, 0) = a(i, k);
    return column;
}

// The scalar product.
template <int Rows>
double dot(const small_matrix<Rows, 1> &a, const small_matrix<Rows, 1> &b) {
    double sum = 0.0;
    for (int i = 0; i < Rows; ++i) sum += a(i, 0) * b(i, 0);
    return sum;
}

}  // namespace compbox::fitting
