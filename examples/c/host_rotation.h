/* The angular velocity that turns one orientation into another: what an engine's tick did, whatever its integrator. */
#ifndef HOST_ROTATION_H
#define HOST_ROTATION_H

#include <math.h>

/* Quaternions x y z w of any length but zero, angular velocity in world axes [rad/s], the shorter way round. Exact for
 * small angles too: no arc cosine of a number near one. */
static inline void host_angular_velocity(const double from[4], const double to[4], double dt, double angular[3])
{
    /* to times the conjugate of from */
    double x = -to[3] * from[0] + to[0] * from[3] - to[1] * from[2] + to[2] * from[1];
    double y = -to[3] * from[1] + to[1] * from[3] - to[2] * from[0] + to[0] * from[2];
    double z = -to[3] * from[2] + to[2] * from[3] - to[0] * from[1] + to[1] * from[0];
    double w = to[3] * from[3] + to[0] * from[0] + to[1] * from[1] + to[2] * from[2];
    double sine = sqrt(x * x + y * y + z * z);
    double factor = sine > 0.0 ? 2.0 * atan2(sine, fabs(w)) / sine : 0.0;

    if (w < 0.0)
        factor = -factor;
    angular[0] = factor * x / dt;
    angular[1] = factor * y / dt;
    angular[2] = factor * z / dt;
}

#endif
