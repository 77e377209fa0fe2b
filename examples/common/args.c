/* args.c - the command line of the examples. */
#include "common.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const char *program;
    const ex_option *options;
    int count;
} command_line;

static int has_range(const ex_option *o) { return o->low < o->high; }

/* Length of the first of the choices in text, which end at '|' or '\0'. */
static size_t choice_length(const char *text) { return strcspn(text, "|"); }

static int choice_index(const char *choices, const char *text) {
    size_t length = strlen(text);
    for (int i = 0;; i++) {
        size_t n = choice_length(choices);
        if (n == length && strncmp(choices, text, n) == 0) return i;
        if (choices[n] == '\0') return -1;
        choices += n + 1;
    }
}

static void print_choice(FILE *to, const char *choices, int index) {
    while (index-- > 0 && choices[choice_length(choices)] != '\0') choices += choice_length(choices) + 1;
    fprintf(to, "%.*s", (int)choice_length(choices), choices);
}

static void print_allowed(FILE *to, const ex_option *o) {
    if (o->kind == EX_CHOICE) {
        fprintf(to, "one of %s", o->choices);
        return;
    }
    if (o->kind == EX_TEXT) {
        fprintf(to, "a text");
        return;
    }
    fprintf(to, o->kind == EX_INT ? "a whole number" : "a finite number");
    if (has_range(o)) fprintf(to, " from %g to %g", o->low, o->high);
    if (o->unit && o->unit[0]) fprintf(to, " [%s]", o->unit);
}

static void print_default(const ex_option *o) {
    const char *unit = o->unit ? o->unit : "";
    const char *text;
    switch (o->kind) {
    case EX_REAL: printf("%g %s", *(const double *)o->value, unit); break;
    case EX_INT: printf("%d %s", *(const int *)o->value, unit); break;
    case EX_TEXT:
        text = *(const char *const *)o->value;
        printf("%s", text && text[0] ? text : "(none)");
        break;
    case EX_CHOICE: print_choice(stdout, o->choices, *(const int *)o->value); break;
    case EX_FLAG: printf("%s", *(const int *)o->value ? "on" : "off"); break;
    }
}

static void print_option(const ex_option *o) {
    static const char *const value_name[] = { "NUMBER", "COUNT", "TEXT", "", "CHOICE" };
    int width = printf("  --%s %s", o->name, value_name[o->kind]);
    printf("%*s%s\n", width < 28 ? 28 - width : 1, "", o->help);
    if (o->kind == EX_FLAG) return;
    printf("%28s[", "");
    print_default(o);
    if (o->kind == EX_CHOICE) printf("; one of %s", o->choices);
    else if (has_range(o)) printf("; from %g to %g", o->low, o->high);
    printf("]\n");
}

static void print_usage(const command_line *line, const char *summary) {
    printf("%s - %s\n\nusage: %s [--option value ...]\n\n", line->program, summary, line->program);
    for (int i = 0; i < line->count; i++) print_option(&line->options[i]);
    printf("  %-26sshow this text\n", "--help");
}

static int least(int a, int b) { return a < b ? a : b; }

/* Number of insertions, deletions and replacements between two names. */
static int edit_distance(const char *a, const char *b) {
    enum { LONGEST = 63 };
    int row[LONGEST + 1];
    int n = least((int)strlen(b), LONGEST);
    for (int j = 0; j <= n; j++) row[j] = j;
    for (int i = 1; a[i - 1] != '\0'; i++) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= n; j++) {
            int replaced = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            row[j] = least(replaced, least(row[j], row[j - 1]) + 1);
        }
    }
    return row[n];
}

static void fail_unknown(const command_line *line, const char *argument) {
    const char *nearest = NULL;
    int distance = 3; /* further away it would be a guess, not a hint */
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(argument, "="), argument);
    for (int i = 0; i < line->count; i++) {
        const char *candidate = line->options[i].name;
        int d = edit_distance(name + strspn(name, "-"), candidate);
        if (d >= distance || d >= (int)strlen(candidate)) continue;
        nearest = candidate;
        distance = d;
    }
    fprintf(stderr, "%s: unknown option '%s'", line->program, argument);
    if (nearest) fprintf(stderr, "; did you mean --%s?", nearest);
    fprintf(stderr, "\n(--help lists the options)\n");
    exit(2);
}

static void fail_value(const command_line *line, const ex_option *o, const char *found) {
    fprintf(stderr, "%s: --%s ", line->program, o->name);
    if (found) fprintf(stderr, "has the value '%s'", found);
    else fprintf(stderr, "lacks its value");
    if (o->kind == EX_FLAG) fprintf(stderr, "; it takes none");
    else fprintf(stderr, "; allowed is "), print_allowed(stderr, o);
    fprintf(stderr, "\n");
    exit(2);
}

static int in_range(const ex_option *o, double value) {
    return !has_range(o) || (value >= o->low && value <= o->high);
}

/* Each store function returns 0 when the text is not an allowed value. */
static int store_real(const ex_option *o, const char *text) {
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(value)) return 0;
    if (!in_range(o, value)) return 0;
    *(double *)o->value = value;
    return 1;
}

static int store_int(const ex_option *o, const char *text) {
    char *end;
    errno = 0;
    long value = strtol(text, &end, 10);
    if (end == text || *end != '\0' || errno != 0) return 0;
    if (value < INT_MIN || value > INT_MAX) return 0;
    if (!in_range(o, (double)value)) return 0;
    *(int *)o->value = (int)value;
    return 1;
}

static int store_choice(const ex_option *o, const char *text) {
    int index = choice_index(o->choices, text);
    if (index >= 0) *(int *)o->value = index;
    return index >= 0;
}

static int store(const ex_option *o, const char *text) {
    switch (o->kind) {
    case EX_REAL: return store_real(o, text);
    case EX_INT: return store_int(o, text);
    case EX_CHOICE: return store_choice(o, text);
    case EX_TEXT: *(const char **)o->value = text; return 1;
    case EX_FLAG: break;
    }
    return 0;
}

static const ex_option *find_option(const command_line *line, const char *argument) {
    size_t length = strcspn(argument, "=");
    if (strncmp(argument, "--", 2) != 0) return NULL;
    for (int i = 0; i < line->count; i++) {
        const char *name = line->options[i].name;
        if (strlen(name) == length - 2 && strncmp(name, argument + 2, length - 2) == 0) return &line->options[i];
    }
    return NULL;
}

void ex_arguments(int argc, char **argv, const char *program, const char *summary, const ex_option *options,
                  int count) {
    command_line line = { program, options, count };
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--help") != 0) continue;
        print_usage(&line, summary);
        exit(0);
    }
    for (int i = 1; i < argc; i++) {
        const ex_option *o = find_option(&line, argv[i]);
        const char *equals = strchr(argv[i], '=');
        const char *text = equals ? equals + 1 : NULL;
        if (!o) fail_unknown(&line, argv[i]);
        if (o->kind == EX_FLAG && !text) {
            *(int *)o->value = 1;
            continue;
        }
        /* A following option means that the value was forgotten. */
        if (!text && o->kind != EX_FLAG && i + 1 < argc && strncmp(argv[i + 1], "--", 2) != 0) text = argv[++i];
        if (!text || !store(o, text)) fail_value(&line, o, text);
    }
}
