// Empty: what exported searches need of Metal is in metal_stdlib beside this folder.
