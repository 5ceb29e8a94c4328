/* Runs work(1) and work(2) at the same time; returns 0 when both have ended. */
#include <pthread.h>

typedef void (*work_type)(int);

struct task {
    work_type work;
    int number;
};

static void *run(void *task)
{
    struct task *mine = task;
    mine->work(mine->number);
    return NULL;
}

int kschur_test_two_threads(work_type work)
{
    struct task tasks[2] = {{work, 1}, {work, 2}};
    pthread_t threads[2];
    int i, started = 0;

    for (i = 0; i < 2; i++) {
        if (pthread_create(&threads[i], NULL, run, &tasks[i]) != 0) break;
        started++;
    }
    for (i = 0; i < started; i++) pthread_join(threads[i], NULL);
    return started == 2 ? 0 : 1;
}
