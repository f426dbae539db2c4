enum { VARIABLES = $count, SAMPLES = $samples };

static const double START[VARIABLES] = {$start};
static const double SIZES[VARIABLES] = {$sizes};
$times
// Takes classical Runge-Kutta steps from one time to another.
static void take(int steps, double from, double to, double z[VARIABLES])
{
    static const double at[4] = {0, 0.5, 0.5, 1}, share[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    const double dt = (to - from) / steps;
    for (int n = 0; n < steps; n++) {
        double k[VARIABLES] = {0}, sum[VARIABLES] = {0}, y[VARIABLES];
        for (int stage = 0; stage < 4; stage++) {
            for (int i = 0; i < VARIABLES; i++) y[i] = z[i] + at[stage] * dt * k[i];
            f(from + (n + at[stage]) * dt, y, k);
            for (int i = 0; i < VARIABLES; i++) sum[i] += share[stage] * k[i];
        }
        for (int i = 0; i < VARIABLES; i++) z[i] += dt * sum[i];
    }
}

// Takes 4 steps and, from the same state, 8; where these differ, each half of the time by itself.
// Errors are 1e-11 of the SIZES of the variables on the way, as rounding is in the way of less.
static int follow(double from, double to, double z[VARIABLES], int halvings)
{
    double coarse[VARIABLES], fine[VARIABLES];
    int same = 1;
    for (int i = 0; i < VARIABLES; i++) coarse[i] = fine[i] = z[i];
    take(4, from, to, coarse);
    take(8, from, to, fine);
    for (int i = 0; i < VARIABLES; i++) same = same && fabs(fine[i] - coarse[i]) <= 1e-11 * SIZES[i];
    for (int i = 0; same && i < VARIABLES; i++) z[i] = fine[i];
    const double middle = from + (to - from) / 2;
    return same || (halvings && follow(from, middle, z, halvings - 1) && follow(middle, to, z, halvings - 1));
}

int main(void)
{
    double t = 0, state[VARIABLES];
    for (int i = 0; i < VARIABLES; i++) state[i] = START[i];
    puts("$head");
    for (int sample = 0; sample < SAMPLES; sample++) {
        const double next = $next;
        if (next > t && !follow(t, next, state, 40)) {
            fprintf(stderr, "no Runge-Kutta steps are short enough after t = %.6g\n", t);
            return 1;
        }
        t = next;
        printf("%.17g", t);
$cells        putchar('\n');
    }
    return 0;
}
