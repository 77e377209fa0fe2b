/* punch_block.c - the block with holes of tensile_block.c, punched instead of pulled: 001 section 7.2.2 */
#define PUNCH 1
#include "tensile_block.c"
