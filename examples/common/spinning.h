/* spinning.h - what the drivers of the spinning plate and the spinning cube share: 002 section 5.2, figures 11 to 14 */
#ifndef SPINNING_H
#define SPINNING_H

/* The whole program for 2 or 3 dimensions; returns the exit code. */
int spinning_main(int argc, char **argv, int dimension);

#endif
