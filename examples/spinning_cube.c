/* spinning_cube.c - momenta of a free cube that spins: 002 section 5.2 (50 x 50 x 50 to 2 s by options) */
#include "common/spinning.h"

int main(int argc, char **argv) { return spinning_main(argc, argv, 3); }
