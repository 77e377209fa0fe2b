/* minimal.c - the smallest whole program: a rubber beam, clamped at one end, swings under its own weight.
   cc -I.. minimal.c -lm && ./a.out */
#define TLSPH_IMPLEMENTATION
#include "tlsph.h"

#include <stdio.h>

int main(void) {
    /* geometry: 4 m x 1 m x 1 m, particles every 0.25 m, on the faces too */
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_cloud beam;
    tlsph_error error;
    fill.size[0] = 4; fill.size[1] = 1; fill.size[2] = 1;
    fill.spacing = (tlsph_real)0.25;
    if (tlsph_cloud_create(&fill, &beam, &error)) { puts(error.message); return 1; }

    /* conditions: all particles at X = 0 are clamped, gravity acts on every particle */
    uint32_t root[1024];
    tlsph_condition conditions[2] = { tlsph_condition_default(TLSPH_CLAMPED),
                                      tlsph_condition_default(TLSPH_ACCELERATION) };
    conditions[0].particles = root;
    conditions[0].count = tlsph_select_plane(&beam.particles, 0, 0, (tlsph_real)1e-6, root, 1024);
    conditions[1].value[1] = (tlsph_real)-9.81;

    tlsph_material rubber = tlsph_material_default(TLSPH_NEO_HOOKEAN);
    rubber.density = 1100; rubber.young = 1000000; rubber.poisson = (tlsph_real)0.4;

    tlsph_desc desc = tlsph_desc_default(3);
    desc.particles = beam.particles;
    desc.materials = &rubber;      desc.material_count = 1;
    desc.conditions = conditions;  desc.condition_count = 2;
    tlsph_solver *solver;
    if (tlsph_create(&desc, &solver, &error)) { puts(error.message); return 1; }

    for (int tenth = 1; tenth <= 10; tenth++) {
        tlsph_ledger ledger;
        if (tlsph_advance(solver, (tlsph_real)tenth / 10)) { puts(tlsph_last_error(solver)->message); return 1; }
        tlsph_ledger_read(solver, &ledger);
        printf("t = %.1f s, centre at height %8.4f m, kinetic energy %8.2f J, energy residual %.1e J\n", ledger.time,
               ledger.centre[1], ledger.kinetic_energy, ledger.energy_residual);
    }
    tlsph_destroy(solver);
    tlsph_cloud_destroy(&beam);
    return 0;
}
