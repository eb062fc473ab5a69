// Mass, centre of mass and inertia of a solid of uniform density, from its closed surface with outward winding.
#ifndef MASS_PROPERTIES_HPP
#define MASS_PROPERTIES_HPP

#include <LinearMath/btMatrix3x3.h>

#include <cstddef>
#include <cstdint>
#include <vector>

struct MassProperties {
    double volume;            // [m^3]
    btVector3 centre;         // [m]
    btMatrix3x3 axes;         // columns: principal axes
    btVector3 inertia_by_mass; // principal moments over the mass [m^2]
};

// Sums over the tetrahedra between the origin and each face. With corners a b c and s = a + b + c, one of volume V has
//   first moment V s / 4,   second moment V (s s^T + a a^T + b b^T + c c^T) / 20.
inline MassProperties mass_properties(const std::vector<double> &positions, const std::vector<std::uint32_t> &triangles)
{
    double volume = 0.0;
    btVector3 first(0, 0, 0);
    double second[3][3] = {};
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
        btVector3 x[4]; // the corners and their sum
        x[3].setZero();
        for (int i = 0; i < 3; i++) {
            const double *p = &positions[3 * triangles[t + i]];
            x[i] = btVector3(p[0], p[1], p[2]);
            x[3] += x[i];
        }
        const double v = x[0].dot(x[1].cross(x[2])) / 6.0;
        volume += v;
        first += x[3] * (v / 4.0);
        for (const btVector3 &p : x)
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++)
                    second[i][j] += v / 20.0 * p[i] * p[j];
    }
    const btVector3 centre = first / volume;
    double covariance[3][3], trace = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            covariance[i][j] = second[i][j] / volume - centre[i] * centre[j];
    for (int i = 0; i < 3; i++)
        trace += covariance[i][i];
    btMatrix3x3 inertia;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            inertia[i][j] = (i == j ? trace : 0.0) - covariance[i][j];
    MassProperties result;
    result.volume = volume;
    result.centre = centre;
    inertia.diagonalize(result.axes, 1e-14, 60); // leaves the moments on the diagonal
    result.inertia_by_mass = btVector3(inertia[0][0], inertia[1][1], inertia[2][2]);
    return result;
}

#endif
