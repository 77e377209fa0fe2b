/* breathing_ball.c - radial mode of a free ball on an irregular cloud, with the exact frequency (METHOD section 7) */
#include "common/driver.h"

int main(int argc, char **argv) {
    cloud_mode_parameters p;
    breathing_ball_default(&p);
    return driver_cloud_mode(argc, argv, "breathing_ball", "radial mode of a free ball with an exact frequency", &p);
}
