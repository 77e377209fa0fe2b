/* spinning_plate.c - momenta of a free plate that spins, plane strain: 002 section 5.2 (200 x 200 to 2 s by options) */
#include "common/spinning.h"

int main(int argc, char **argv) { return spinning_main(argc, argv, 2); }
