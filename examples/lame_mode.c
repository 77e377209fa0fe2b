/* lame_mode.c - Lame's mode of a cube without any traction, on an irregular cloud (METHOD section 7) */
#include "common/driver.h"

int main(int argc, char **argv) {
    cloud_mode_parameters p;
    lame_mode_default(&p);
    return driver_cloud_mode(argc, argv, "lame_mode", "Lame's mode of a traction-free cube with an exact frequency", &p);
}
