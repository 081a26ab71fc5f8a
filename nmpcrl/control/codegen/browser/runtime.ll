; What numba's code calls and a browser does not have. Sizes are 64 bit as in numba, addresses 32.
;
; Memory: [stack | constants | what the host reserves | scratch, whole at the next call | end].

@stack = global [65536 x i8] zeroinitializer, align 16  ; `link` has these two numbers, too
@bottom = global i32 131072  ; where scratch begins
@heap = global i32 0     ; the first free byte of scratch
@last = global i32 0     ; the array that ends there, or 0
@fault = global i32 0    ; why a call was ended: 1 no memory, 2 a size, 3 an error of the function

declare void @llvm.trap()
declare i32 @llvm.wasm.memory.size.i32(i32)

define void @end_call(i32 %why) noinline noreturn {
  store i32 %why, ptr @fault
  call void @llvm.trap()
  unreachable
}

; Memory from `from` on, in multiples of 16, or the end.
define i32 @after(i32 %from, i64 %size) alwaysinline {
  %large = icmp ugt i64 %size, 1073741824
  br i1 %large, label %none, label %small
small:
  %bytes = trunc i64 %size to i32
  %more = add i32 %bytes, 15
  %round = and i32 %more, -16
  %next = add i32 %from, %round
  %pages = call i32 @llvm.wasm.memory.size.i32(i32 0)
  %ceiling = shl i32 %pages, 16
  %beyond = icmp ugt i32 %next, %ceiling
  br i1 %beyond, label %none, label %there
none:
  call void @end_call(i32 1)
  unreachable
there:
  ret i32 %next
}

; For the host's own arrays, which stay.
define i32 @reserve(i32 %size) {
  %from = load i32, ptr @bottom
  %wide = zext i32 %size to i64
  %next = call i32 @after(i32 %from, i64 %wide)
  store i32 %next, ptr @bottom
  ret i32 %from
}

; Give back what was reserved from an address on.
define void @release(i32 %from) {
  store i32 %from, ptr @bottom
  ret void
}

define i32 @why() {
  %fault = load i32, ptr @fault
  store i32 0, ptr @fault
  ret i32 %fault
}

; An array of numba's: { references, destructor, its argument, data, size }, then our own two, the
; array before it and whether it is given back, and then the data.
%array_info = type { i64, ptr, ptr, ptr, i64, i32, i32 }

define noalias ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %alignment) noinline {
  %from = load i32, ptr @heap
  %data = call i32 @after(i32 %from, i64 48)
  %next = call i32 @after(i32 %data, i64 %size)
  store i32 %next, ptr @heap
  %info = inttoptr i32 %from to ptr
  %array = inttoptr i32 %data to ptr
  %destructor = getelementptr %array_info, ptr %info, i32 0, i32 1
  %content = getelementptr %array_info, ptr %info, i32 0, i32 3
  %length = getelementptr %array_info, ptr %info, i32 0, i32 4
  store i64 1, ptr %info
  store ptr null, ptr %destructor
  store ptr %array, ptr %content
  store i64 %size, ptr %length
  %before = getelementptr %array_info, ptr %info, i32 0, i32 5
  %free = getelementptr %array_info, ptr %info, i32 0, i32 6
  %last = load i32, ptr @last
  store i32 %last, ptr %before
  store i32 0, ptr %free
  store i32 %from, ptr @last
  ret ptr %info
}

; Nobody refers to an array any more. Scratch ends before all such arrays at its end.
define void @NRT_MemInfo_call_dtor(ptr %info) noinline {
begin:
  %given = getelementptr %array_info, ptr %info, i32 0, i32 6
  store i32 1, ptr %given
  br label %look
look:
  %last = load i32, ptr @last
  %none = icmp eq i32 %last, 0
  br i1 %none, label %done, label %ask
ask:
  %array = inttoptr i32 %last to ptr
  %free = getelementptr %array_info, ptr %array, i32 0, i32 6
  %state = load i32, ptr %free
  %in_use = icmp eq i32 %state, 0
  br i1 %in_use, label %done, label %drop
drop:
  %before = getelementptr %array_info, ptr %array, i32 0, i32 5
  %next = load i32, ptr %before
  store i32 %next, ptr @last
  store i32 %last, ptr @heap
  br label %look
done:
  ret void
}

; Of contiguous arrays only: there are no others.
define i32 @numba_attempt_nocopy_reshape(i64 %nd, ptr %dims, ptr %strides, i64 %new_nd, ptr %new_dims, ptr %new_strides, i64 %itemsize, i32 %fortran) alwaysinline {
begin:
  br label %axis
axis:
  %left = phi i64 [ %new_nd, %begin ], [ %at, %body ]
  %stride = phi i64 [ %itemsize, %begin ], [ %wider, %body ]
  %more = icmp sgt i64 %left, 0
  br i1 %more, label %body, label %done
body:
  %at = sub i64 %left, 1
  %index = trunc i64 %at to i32
  %to = getelementptr i64, ptr %new_strides, i32 %index
  store i64 %stride, ptr %to
  %of = getelementptr i64, ptr %new_dims, i32 %index
  %dim = load i64, ptr %of
  %wider = mul i64 %stride, %dim
  br label %axis
done:
  ret i32 1
}

; Of sizes, which are small or wrong: LLVM's own would need a product of 128 bits.
define { i64, i1 } @product_of_sizes(i64 %a, i64 %b) alwaysinline {
  %large_a = icmp ugt i64 %a, 1073741824
  %large_b = icmp ugt i64 %b, 1073741824
  %large = or i1 %large_a, %large_b
  br i1 %large, label %wrong, label %right
wrong:
  call void @end_call(i32 2)
  unreachable
right:
  %product = mul i64 %a, %b
  %value = insertvalue { i64, i1 } poison, i64 %product, 0
  %result = insertvalue { i64, i1 } %value, i1 false, 1
  ret { i64, i1 } %result
}
