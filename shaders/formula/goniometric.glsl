#ifndef __cplusplus
#include "formula/angle.glsl"
#endif

// A light whose intensity is tabulated over directions (a photometric web, type C). In the light's frame it shines
// along -Z (nadir, gamma = 0), C = 0 lies towards +X, C = pi/2 towards +Y. The formulas say where in the table to look
// and how to mix; who keeps the table, in an array or a texture, does not matter.

// gamma in [0, pi], from nadir. The direction has any length but 0, which gives 0.
FORMULA_FN Real webGamma(Vec3 directionLight) {
    Vec3 d = normalizeOr(directionLight, Vec3(REAL(0.0)));
    return angleOf(sqrt(d.x * d.x + d.y * d.y), -d.z);
}

// C in [0, 2 pi]. Straight down or up, where all planes meet, it is 0.
FORMULA_FN Real webPlane(Vec3 directionLight) {
    Vec3 d = normalizeOr(directionLight, Vec3(REAL(0.0)));
    Real c = angleOf(d.y, d.x);
    return c < REAL(0.0) ? c + REAL(2.0) * kPi : c;
}

// Four entries of a regular table and the weights between them.
struct WebPlace {
    int column0;  // planes of C: column i stands at 2 pi i / columns, and the last one is followed by the first
    int column1;
    int row0;  // gamma: row j stands at pi j / (rows - 1)
    int row1;
    Real across;  // [0, 1], from column0 to column1
    Real down;    // [0, 1], from row0 to row1
};

// columns >= 1, rows >= 2; both at most 2^12, which leaves a float 2^-11 of a step.
FORMULA_FN WebPlace webPlace(Vec3 directionLight, int columns, int rows) {
    Real x = webPlane(directionLight) / (REAL(2.0) * kPi) * Real(columns);
    Real y = webGamma(directionLight) / kPi * Real(rows - 1);
    // By rounding, x may reach `columns` and y pass the last row.
    int column = min(int(x), columns - 1);
    int row = min(int(y), rows - 2);
    WebPlace place;
    place.column0 = column;
    place.column1 = column + 1 == columns ? 0 : column + 1;
    place.row0 = row;
    place.row1 = row + 1;
    place.across = saturate(x - Real(column));
    place.down = saturate(y - Real(row));
    return place;
}

// How far `angle` is on the way from `lower` to `upper`, for tables with steps of their own: [0, 1]; 0 for an empty
// step.
FORMULA_FN Real tableFraction(Real lower, Real upper, Real angle) {
    if (!(upper > lower)) return REAL(0.0);
    return saturate((angle - lower) / (upper - lower));
}

// Bilinear: entry (column, row), weights as in WebPlace. The result has the unit of the entries (candela, or W/sr).
FORMULA_FN Real webIntensity(Real entry00, Real entry10, Real entry01, Real entry11, Real across, Real down) {
    return mix(mix(entry00, entry10, across), mix(entry01, entry11, across), down);
}
