#include "support.h"

/* ---- random numbers and small tensors ---- */

double random_between(uint64_t *state, double low, double high)
{
    uint64_t z = (*state += 0x9E3779B97F4A7C15u); /* splitmix64 */
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    return low + (high - low) * ((double)(z >> 11) / 9007199254740992.0);
}

void random_deformation(uint64_t *state, double amount, tlsph_real F[9])
{
    int i;
    do {
        for (i = 0; i < 9; i++) F[i] = R((i % 4 == 0) + random_between(state, -amount, amount));
    } while (tlsph_determinant(F) < R(0.2));
}

void random_rotation(uint64_t *state, tlsph_real Q[9])
{
    double q[4], n = 0;
    int i;
    for (i = 0; i < 4; i++) { q[i] = random_between(state, -1, 1); n += q[i] * q[i]; }
    for (i = 0; i < 4; i++) q[i] /= sqrt(n);
    Q[0] = R(1 - 2 * (q[2] * q[2] + q[3] * q[3]));
    Q[1] = R(2 * (q[1] * q[2] - q[3] * q[0]));
    Q[2] = R(2 * (q[1] * q[3] + q[2] * q[0]));
    Q[3] = R(2 * (q[1] * q[2] + q[3] * q[0]));
    Q[4] = R(1 - 2 * (q[1] * q[1] + q[3] * q[3]));
    Q[5] = R(2 * (q[2] * q[3] - q[1] * q[0]));
    Q[6] = R(2 * (q[1] * q[3] - q[2] * q[0]));
    Q[7] = R(2 * (q[2] * q[3] + q[1] * q[0]));
    Q[8] = R(1 - 2 * (q[1] * q[1] + q[2] * q[2]));
}

void multiply(const tlsph_real A[9], const tlsph_real B[9], tlsph_real C[9])
{
    int i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
}

double largest(const tlsph_real *values, size_t count)
{
    double most = 0;
    size_t i;
    for (i = 0; i < count; i++)
        if (!(fabs((double)values[i]) <= most)) most = fabs((double)values[i]); /* a NaN comes through */
    return most;
}

/* ---- counting allocator ---- */

#define TALLY_HEAD 64 /* keeps the alignment of malloc and holds the size */

static void *tally_allocate(void *user, size_t size)
{
    tally *counts = user;
    unsigned char *block;
    counts->calls++;
    if (counts->calls == counts->fail_at) return NULL;
    block = malloc(size + TALLY_HEAD);
    if (!block) return NULL;
    memcpy(block, &size, sizeof size);
    memset(block + TALLY_HEAD, 0xA5, size); /* nobody may count on zeros */
    counts->live++;
    if (counts->live > counts->most_live) counts->most_live = counts->live;
    counts->live_bytes += size;
    if (counts->live_bytes > counts->most_bytes) counts->most_bytes = counts->live_bytes;
    return block + TALLY_HEAD;
}

static void tally_release(void *user, void *memory, size_t size)
{
    tally *counts = user;
    unsigned char *block;
    size_t asked;
    if (!memory) return;
    block = (unsigned char *)memory - TALLY_HEAD;
    memcpy(&asked, block, sizeof asked);
    counts->wrong_size = counts->wrong_size || asked != size;
    counts->live--;
    counts->live_bytes -= asked;
    free(block);
}

tlsph_allocator tally_allocator(tally *counts)
{
    tlsph_allocator allocator;
    allocator.allocate = tally_allocate;
    allocator.release = tally_release;
    allocator.user = counts;
    return allocator;
}

/* ---- clouds ---- */

static void *copy_of(const void *source, size_t bytes)
{
    void *copy = source && bytes ? malloc(bytes) : NULL;
    if (copy) memcpy(copy, source, bytes);
    return copy;
}

int own_copy(own_cloud *cloud, const tlsph_particles *particles, int dimension)
{
    size_t n = particles->count, corners = dimension == 3 ? 8 : 4;
    memset(cloud, 0, sizeof *cloud);
    cloud->particles = *particles;
    cloud->positions = copy_of(particles->positions, 3 * n * sizeof(tlsph_real));
    cloud->volumes = copy_of(particles->volumes, n * sizeof(tlsph_real));
    cloud->weights = copy_of(particles->weights, n * sizeof(tlsph_real));
    cloud->cells = copy_of(particles->cells, corners * particles->cell_count * sizeof(uint32_t));
    cloud->materials = calloc(n + 1, 1);
    if (!cloud->positions || !cloud->volumes || !cloud->materials) { own_cloud_destroy(cloud); return 0; }
    cloud->particles.positions = cloud->positions;
    cloud->particles.volumes = cloud->volumes;
    cloud->particles.weights = cloud->weights;
    cloud->particles.materials = cloud->materials;
    cloud->particles.cells = cloud->cells;
    return 1;
}

int own_box(own_cloud *cloud, int dimension, const int cells[3], double spacing, double jitter)
{
    tlsph_fill fill = tlsph_fill_default(dimension);
    tlsph_cloud lattice;
    int i, made;
    for (i = 0; i < dimension; i++) fill.size[i] = R(cells[i] * spacing);
    fill.spacing = R(spacing);
    fill.jitter = R(jitter);
    fill.seed = 7;
    if (tlsph_cloud_create(&fill, &lattice, NULL)) return 0;
    made = own_copy(cloud, &lattice.particles, dimension);
    tlsph_cloud_destroy(&lattice);
    return made;
}

void own_cloud_destroy(own_cloud *cloud)
{
    free(cloud->positions);
    free(cloud->volumes);
    free(cloud->weights);
    free(cloud->materials);
    free(cloud->cells);
    memset(cloud, 0, sizeof *cloud);
}

/* ---- scenes ---- */

void closed_operator(tlsph_desc *desc)
{
    desc->operator_kind = TLSPH_CLOSED;
    desc->kernel = TLSPH_WENDLAND_C2;
    desc->support = R(0.825);
}

tlsph_material soft_material(tlsph_material_kind kind)
{
    tlsph_material m = tlsph_material_default(kind);
    m.density = 1000;
    m.young = R(50.05e3);
    m.poisson = R(0.3);
    m.expansion = kind == TLSPH_NEO_HOOKEAN ? 0 : R(2.223e-4);
    m.specific_heat = 1;
    m.conductivity = 10;
    m.reference_temperature = R(293.15);
    if (kind == TLSPH_VON_MISES) {
        m.yield_stress = 200;
        m.hardening = 2000;
        m.plastic_heat = R(0.9);
    }
    return m;
}

moving_block moving_block_default(void)
{
    moving_block s;
    memset(&s, 0, sizeof s);
    s.dimension = 3;
    s.cells = 3;
    s.unknowns = TLSPH_PFHJ;
    s.thermal = TLSPH_ENERGY;
    s.material = TLSPH_MIE_GRUNEISEN;
    s.threads = 1; /* for so few particles more threads only wait for each other */
    return s;
}

static int moving_block_conditions(const moving_block *s, const tlsph_particles *particles, uint32_t *left, uint32_t *right,
                            tlsph_condition conditions[4])
{
    conditions[0] = tlsph_condition_default(s->slides ? TLSPH_ROLLER : TLSPH_CLAMPED);
    conditions[0].normal[0] = s->slides ? 1 : 0;
    conditions[0].particles = left;
    conditions[0].count = tlsph_select_plane(particles, 0, 0, R(1e-4), left, particles->count);
    if (s->unloaded == 1) return 1;
    if (s->unloaded == 2) {
        conditions[1] = tlsph_condition_default(TLSPH_WALL);
        conditions[1].normal[1] = 1;
        conditions[1].point[1] = -100;
        return 2;
    }
    conditions[1] = tlsph_condition_default(TLSPH_ACCELERATION);
    conditions[1].value[1] = R(-9.81);
    if (s->thermal == TLSPH_ISOTHERMAL) return 2;
    conditions[2] = tlsph_condition_default(TLSPH_HEAT_SOURCE);
    conditions[2].value[0] = 2000;
    conditions[3] = tlsph_condition_default(TLSPH_TEMPERATURE);
    conditions[3].particles = right;
    conditions[3].count = tlsph_select_plane(particles, 0, 1, R(1e-4), right, particles->count);
    conditions[3].value[0] = 300;
    return 4;
}

static tlsph_desc moving_block_desc(const moving_block *s, const own_cloud *cloud, const tlsph_material *material)
{
    tlsph_desc desc = tlsph_desc_default(s->dimension);
    desc.particles = cloud->particles;
    desc.materials = material;
    desc.material_count = 1;
    desc.unknowns = s->unknowns;
    desc.thermal = s->thermal;
    desc.integrator = s->integrator;
    desc.dissipation = s->dissipation;
    desc.threads = s->threads;
    desc.audit = s->audit;
    desc.run = s->run;
    desc.run_user = s->run_user;
    desc.allocator = s->allocator;
    if (s->jitter > 0) desc.support = R(0.9);
    desc.sharp_gradients = s->sharp;
    if (s->sharp) desc.operator_kind = TLSPH_CELLS;
    if (s->kind) desc.operator_kind = s->kind;
    desc.force_form = s->force_form;
    return desc;
}

tlsph_result moving_block_create(const moving_block *s, tlsph_solver **solver, tlsph_error *error)
{
    int cells[3];
    own_cloud cloud;
    tlsph_material material = soft_material(s->material);
    tlsph_condition conditions[4];
    tlsph_desc desc;
    tlsph_result result = TLSPH_ERROR_MEMORY;
    uint32_t *sets;
    *solver = NULL;
    if (s->mooney > 0) material.mooney_fraction = R(s->mooney);
    if (s->insulated) material.conductivity = 0;
    cells[0] = cells[1] = cells[2] = s->cells;
    if (!own_box(&cloud, s->dimension, cells, 1.0 / s->cells, s->jitter)) return result;
    sets = malloc(2 * cloud.particles.count * sizeof *sets);
    desc = moving_block_desc(s, &cloud, &material);
    desc.conditions = conditions;
    if (sets) {
        desc.condition_count =
            (size_t)moving_block_conditions(s, &cloud.particles, sets, sets + cloud.particles.count, conditions);
        result = tlsph_create(&desc, solver, error);
    }
    free(sets);
    own_cloud_destroy(&cloud);
    return result;
}

tlsph_result moving_block_kick(tlsph_solver *solver, double speed)
{
    size_t a, n = tlsph_count(solver);
    tlsph_real *X = read_field(solver, TLSPH_FIELD_REFERENCE_POSITION), *v = read_field(solver, TLSPH_FIELD_VELOCITY);
    tlsph_result result = TLSPH_ERROR_MEMORY;
    if (X && v) {
        for (a = 0; a < n; a++) { /* zero at X = 0, where the scene is clamped */
            double x = (double)X[3 * a], y = (double)X[3 * a + 1];
            v[3 * a] = R(0.5 * speed * x * cos(2 * y));
            v[3 * a + 1] = R(0.5 * speed * sin(2 * x));
            v[3 * a + 2] = 0;
        }
        result = tlsph_write(solver, TLSPH_FIELD_VELOCITY, v);
    }
    free(X);
    free(v);
    return result;
}

/* ---- states ---- */

tlsph_real *read_field(const tlsph_solver *solver, tlsph_field field)
{
    size_t count = tlsph_count(solver) * (size_t)tlsph_field_components(field);
    tlsph_real *values = malloc((count + 1) * sizeof *values);
    if (values && tlsph_read(solver, field, values)) { free(values); return NULL; }
    return values;
}

static uint64_t hash_bytes(uint64_t hash, const void *bytes, size_t count)
{
    const unsigned char *byte = bytes;
    size_t i;
    for (i = 0; i < count; i++) hash = (hash ^ byte[i]) * 0x100000001B3u; /* FNV-1a */
    return hash;
}

uint64_t state_hash(const tlsph_solver *solver)
{
    uint64_t hash = 0xCBF29CE484222325u;
    tlsph_real time = tlsph_time(solver);
    int field;
    for (field = 0; field < TLSPH_FIELD_COUNT; field++) {
        tlsph_real *values = field == TLSPH_FIELD_VELOCITY_GRADIENT ? NULL : read_field(solver, (tlsph_field)field);
        size_t count = tlsph_count(solver) * (size_t)tlsph_field_components((tlsph_field)field);
        if (values) hash = hash_bytes(hash, values, count * sizeof *values);
        free(values);
    }
    return hash_bytes(hash, &time, sizeof time);
}

int state_finite(const tlsph_solver *solver)
{
    int field, finite = 1;
    for (field = 0; field < TLSPH_FIELD_COUNT; field++) {
        tlsph_real *values = read_field(solver, (tlsph_field)field);
        size_t i, count = tlsph_count(solver) * (size_t)tlsph_field_components((tlsph_field)field);
        for (i = 0; values && i < count; i++) finite = finite && isfinite((double)values[i]);
        free(values);
    }
    return finite;
}

tlsph_result take_steps(tlsph_solver *solver, int count)
{
    tlsph_result result = TLSPH_OK;
    while (count-- > 0 && !result) result = tlsph_step(solver, 1);
    return result;
}

unsigned char *save_state(const tlsph_solver *solver, size_t *size)
{
    unsigned char *buffer;
    *size = tlsph_save_size(solver);
    buffer = malloc(*size + 1);
    if (buffer && tlsph_save(solver, buffer, *size)) { free(buffer); return NULL; }
    return buffer;
}
