/* study.h - one run of the study: a scene, a resolution and a set of choices in; error, time and balances out (runs.c). */
#ifndef BENCH_STUDY_H
#define BENCH_STUDY_H

#include "examples/scenes/scenes.h"

#ifdef TLSPH_REAL_FLOAT
#define STUDY_PRECISION "float"
#else
#define STUDY_PRECISION "double"
#endif

typedef enum study_scene { STUDY_CUBE, STUDY_WAVE, STUDY_MANUFACTURED, STUDY_COLUMN, STUDY_BLOCK, STUDY_SCENES } study_scene;

typedef struct study_info {
    const char *name, *title, *measure; /* key, for pictures, what the error is of */
    int n[4];                           /* resolutions: short run 0 and 1, full run 0 to 2 (3: none where 0); prices at n[0] */
    int thermal;                        /* 1: E in the base */
    double bound;                       /* of the error at n[0]; a run above it does not count */
} study_info;
extern const study_info study_scenes[STUDY_SCENES];

/* The base of all comparisons: {p,F}, 6 neighbours, limited reconstruction, projection, two stages at CFL 0.3; isothermal, or
   with E where the scene is thermal. A configuration is a text of words that each change one thing, "sharp rk3" for instance. */
typedef struct study_word { const char *name, *meaning; } study_word;
extern const study_word study_words[];
/* Sets the options of a configuration; 0 where it has an unknown word. */
int study_options(study_scene scene, const char *configuration, scene_options *options);

typedef struct study_run {
    study_scene scene;
    int n;
    char configuration[48], precision[8];
    double particles, steps, cpu;       /* s of the steps alone, without loads that the host computes */
    double error;
    double momentum, angular, energy;   /* what the balances miss; momenta only where nothing holds the body */
    double oscillation;                 /* of the pressure, scene_oscillation */
    int ok;                             /* the error is below its bound and the balances hold */
} study_run;

/* Creates, runs and judges. Failures come out as ok = 0 with an infinite error. */
void study_measure(study_scene scene, int n, const char *configuration, study_run *out);
/* Reads the converged runs that the column and the block are compared with; 0 on success. */
int study_references_read(const char *path);
/* Makes them (minutes) and tells how far two resolutions of the reference are apart; 0 on success. */
int study_references_write(const char *path);

#endif
