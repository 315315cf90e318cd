/* SPDX-License-Identifier: MIT
 * Feeds the files of a folder to a fuzz target, without a fuzzer: any compiler can.  replay_<target> FOLDER */
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n);

static int feed(const char *path)
{
    FILE *file = fopen(path, "rb");
    long n;
    if (file == NULL || fseek(file, 0, SEEK_END) != 0 || (n = ftell(file)) < 0 || fseek(file, 0, SEEK_SET) != 0) {
        perror(path);
        return 1;
    }
    uint8_t *bytes = malloc((size_t)n + 1); /* of the very size: what reads behind the end shows */
    uint8_t *exact = bytes == NULL ? NULL : realloc(bytes, n > 0 ? (size_t)n : 1);
    if (exact == NULL || fread(exact, 1, (size_t)n, file) != (size_t)n) {
        perror(path);
        return 1;
    }
    fclose(file);
    LLVMFuzzerTestOneInput(exact, (size_t)n);
    free(exact);
    return 0;
}

int main(int argc, char **argv)
{
    char path[4096];
    int n = 0;
    DIR *folder = argc == 2 ? opendir(argv[1]) : NULL;
    if (folder == NULL) {
        fprintf(stderr, "usage: %s FOLDER (of inputs)\n", argv[0]);
        return 2;
    }
    for (const struct dirent *e = readdir(folder); e != NULL; e = readdir(folder)) {
        if (e->d_name[0] == '.') continue;
        if (snprintf(path, sizeof path, "%s/%s", argv[1], e->d_name) >= (int)sizeof path || feed(path) != 0) return 1;
        ++n;
    }
    closedir(folder);
    printf("%d inputs\n", n);
    return n > 0 ? 0 : 1;
}
