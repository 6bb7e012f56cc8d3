/* A C program that loads the belt's library and runs it, as a simulator other than Python does.
 * usage: host 2|3 LIBRARY TOKEN YAW[rad] SPEED[m/s] STEP[s] STEPS; prints y1 [m] and the travel [m] at the end. */
#include <dlfcn.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { YAW = 1, SPEED = 4, Y1 = 6, TRAVEL = 10 };

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static void tell2(void *e, const char *name, int status, const char *category, const char *format, ...) {
    (void)e, (void)format;
    fprintf(stderr, "%s: status %d, %s\n", name, status, category);
}
static void tell3(void *e, int status, const char *category, const char *text) {
    (void)e;
    fprintf(stderr, "status %d, %s: %s\n", status, category, text);
}

static void *library;
static void *find(const char *name) {
    void *found = dlsym(library, name);
    if (!found) fprintf(stderr, "%s\n", dlerror()), exit(3);
    return found;
}
#define CALL(type, name) ((type)find(name))
static void need(int status, const char *what) {
    if (status) fprintf(stderr, "%s: status %d\n", what, status), exit(4);
}

int main(int count, char **words) {
    if (count != 8) return 1;
    const int fmi = atoi(words[1]), steps = atoi(words[7]);
    const double in[2] = {atof(words[4]), atof(words[5])}, step = atof(words[6]);
    const uint32_t inputs[2] = {YAW, SPEED}, outputs[2] = {Y1, TRAVEL};
    double out[2];
    library = dlopen(words[2], RTLD_NOW);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 2;
    if (fmi == 2) {
        const Callbacks callbacks = {tell2, calloc, free, NULL, NULL};
        void *belt = CALL(void *(*)(const char *, int, const char *, const char *, const Callbacks *, int, int),
                          "fmi2Instantiate")("belt", 1, words[3], "", &callbacks, 0, 1);
        if (!belt) return 5;
        need(CALL(int (*)(void *, int, double, double, int, double), "fmi2SetupExperiment")(belt, 0, 0, 0, 0, 0), "setup");
        need(CALL(int (*)(void *), "fmi2EnterInitializationMode")(belt), "initialise");
        need(CALL(int (*)(void *), "fmi2ExitInitializationMode")(belt), "initialise");
        need(CALL(int (*)(void *, const uint32_t *, size_t, const double *), "fmi2SetReal")(belt, inputs, 2, in), "set");
        for (int k = 0; k < steps; k++)
            need(CALL(int (*)(void *, double, double, int), "fmi2DoStep")(belt, k * step, step, 1), "step");
        need(CALL(int (*)(void *, const uint32_t *, size_t, double *), "fmi2GetReal")(belt, outputs, 2, out), "get");
        need(CALL(int (*)(void *), "fmi2Terminate")(belt), "terminate");
        CALL(void (*)(void *), "fmi2FreeInstance")(belt);
    } else {
        bool event, end, early;
        double last;
        void *belt = CALL(void *(*)(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *,
                                    size_t, void *, void *, void *),
                          "fmi3InstantiateCoSimulation")("belt", words[3], "", 0, 1, 0, 0, NULL, 0, NULL, tell3, NULL);
        if (!belt) return 5;
        need(CALL(int (*)(void *, bool, double, double, bool, double), "fmi3EnterInitializationMode")(belt, 0, 0, 0, 0, 0),
             "initialise");
        need(CALL(int (*)(void *), "fmi3ExitInitializationMode")(belt), "initialise");
        need(CALL(int (*)(void *, const uint32_t *, size_t, const double *, size_t), "fmi3SetFloat64")(belt, inputs, 2, in, 2),
             "set");
        for (int k = 0; k < steps; k++)
            need(CALL(int (*)(void *, double, double, bool, bool *, bool *, bool *, double *), "fmi3DoStep")(
                     belt, k * step, step, 1, &event, &end, &early, &last), "step");
        need(CALL(int (*)(void *, const uint32_t *, size_t, double *, size_t), "fmi3GetFloat64")(belt, outputs, 2, out, 2),
             "get");
        need(CALL(int (*)(void *), "fmi3Terminate")(belt), "terminate");
        CALL(void (*)(void *), "fmi3FreeInstance")(belt);
    }
    printf("%.15g %.15g\n", out[0], out[1]);
    return 0;
}
