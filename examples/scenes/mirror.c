/* mirror.c - how symmetric the state of a lattice body is. */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>

/* Place on the lattice of cells, so that mirror images are found by comparing integers. */
typedef struct place { long at[3]; size_t particle; } place;

static int compare(const void *a, const void *b) {
    const place *l = a, *r = b;
    for (int i = 0; i < 3; i++)
        if (l->at[i] != r->at[i]) return l->at[i] < r->at[i] ? -1 : 1;
    return 0;
}

static place *places_of(const tlsph_cloud *cloud) {
    const tlsph_particles *p = &cloud->particles;
    place *places = malloc((p->count + 1) * sizeof *places);
    for (size_t a = 0; places && a < p->count; a++) {
        places[a].particle = a;
        for (size_t i = 0; i < 3; i++) /* halves, as the mirror plane may lie between two layers */
            places[a].at[i] = lround(2 * (double)p->positions[3 * a + i] / (double)cloud->cell_size[i]);
    }
    if (places) qsort(places, p->count, sizeof *places, compare);
    return places;
}

double scene_asymmetry(const scene_body *body, int axis) {
    const size_t count = body->cloud.particles.count;
    place *places = places_of(&body->cloud);
    tlsph_real *u = scene_read(body->solver, TLSPH_FIELD_DISPLACEMENT);
    tlsph_real *pressure = scene_read(body->solver, TLSPH_FIELD_PRESSURE);
    double off_u = 0, off_p = 0, size_u = 0, size_p = 0, out = HUGE_VAL;
    size_t found = 0;
    for (size_t a = 0; places && u && pressure && a < count; a++) {
        const size_t me = places[a].particle;
        place image = places[a];
        const place *other;
        image.at[axis] = -image.at[axis];
        other = bsearch(&image, places, count, sizeof *places, compare);
        if (!other) break;
        for (int i = 0; i < 3; i++) {
            const double mine = (double)u[3 * me + (size_t)i], its = (double)u[3 * other->particle + (size_t)i];
            off_u = fmax(off_u, fabs(mine - (i == axis ? -its : its)));
            size_u = fmax(size_u, fabs(mine));
        }
        off_p = fmax(off_p, fabs((double)pressure[me] - (double)pressure[other->particle]));
        size_p = fmax(size_p, fabs((double)pressure[me]));
        found++;
    }
    if (found == count && size_u > 0 && size_p > 0) out = fmax(off_u / size_u, off_p / size_p);
    free(places); free(u); free(pressure);
    return out;
}
