"""Products and copies written as loops: compiled faster than array expressions, and without temporary arrays."""

from __future__ import annotations

from gapbeam.solver.jit import compiled, compiled_apart
from gapbeam.solver.system.operators import Array


@compiled
def fill(x: Array, value: float) -> None:
    """Set all entries."""
    for j in range(len(x)):
        x[j] = value


@compiled
def copy_into(x: Array, y: Array) -> None:
    """Set x to y."""
    for j in range(len(x)):
        x[j] = y[j]


@compiled
def inner_product(x: Array, y: Array) -> float:
    """Return x . y."""
    total = 0.0
    for j in range(len(x)):
        total += x[j] * y[j]
    return total


@compiled_apart
def set_products(matrix: Array, x: Array, products: Array) -> None:
    """Set products, (rows,), to matrix x, four rows at a time."""
    rows, size = len(products), len(x)
    whole = rows - rows % 4
    for r in range(0, whole, 4):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for j in range(size):
            a += matrix[r, j] * x[j]
            b += matrix[r + 1, j] * x[j]
            c += matrix[r + 2, j] * x[j]
            d += matrix[r + 3, j] * x[j]
        products[r], products[r + 1], products[r + 2], products[r + 3] = a, b, c, d
    for r in range(whole, rows):
        products[r] = inner_product(matrix[r], x)


@compiled
def add_rows(matrix: Array, factors: Array, scale: float, x: Array) -> None:
    """Add scale * matrix^T factors to x; rows with a factor of 0 are not read, the others four at a time."""
    rows, size, row = len(factors), len(x), 0
    while True:
        picked, a, b, c = 0, 0, 0, 0
        while row < rows:
            if factors[row] != 0.0:
                picked += 1
                if picked == 1:
                    a = row
                elif picked == 2:
                    b = row
                elif picked == 3:
                    c = row
                else:
                    break
            row += 1
        if picked == 4:
            fa, fb, fc, fd = scale * factors[a], scale * factors[b], scale * factors[c], scale * factors[row]
            first, second, third, fourth = matrix[a], matrix[b], matrix[c], matrix[row]
            for j in range(size):
                x[j] += fa * first[j] + fb * second[j] + fc * third[j] + fd * fourth[j]
            row += 1
            continue
        for number in range(picked):
            chosen = a if number == 0 else (b if number == 1 else c)
            factor, only = scale * factors[chosen], matrix[chosen]
            for j in range(size):
                x[j] += factor * only[j]
        return


@compiled
def add_all_rows(matrix: Array, factors: Array, x: Array) -> None:
    """Add matrix^T factors to x, eight rows at a time; for factors of which hardly any is 0."""
    size, rows = len(x), len(factors)
    whole = rows - rows % 8
    for r in range(0, whole, 8):
        f0, f1, f2, f3 = factors[r], factors[r + 1], factors[r + 2], factors[r + 3]
        f4, f5, f6, f7 = factors[r + 4], factors[r + 5], factors[r + 6], factors[r + 7]
        for j in range(size):
            one = f0 * matrix[r, j] + f1 * matrix[r + 1, j] + f2 * matrix[r + 2, j] + f3 * matrix[r + 3, j]
            two = f4 * matrix[r + 4, j] + f5 * matrix[r + 5, j] + f6 * matrix[r + 6, j] + f7 * matrix[r + 7, j]
            x[j] += one + two
    for r in range(whole, rows):
        factor = factors[r]
        for j in range(size):
            x[j] += factor * matrix[r, j]
